// Bundles the 3D view into one file, with the licence of what is in it, and says its hash.
//
//   npm ci && npm run build
//
// Out: src/report/page/viewer/viewer.min.js and viewer.lock.json, both committed; `cargo test` holds one against the other.

import { createHash } from 'node:crypto';
import { readFileSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';

const here = dirname(fileURLToPath(import.meta.url));
const out = join(here, '../../src/report/page/viewer');
const versionOf = (name) => JSON.parse(readFileSync(join(here, 'node_modules', name, 'package.json'))).version;
const licence = readFileSync(join(here, 'node_modules/three/LICENSE'), 'utf8').trim();

const made = await build({
  absWorkingDir: here,
  entryPoints: ['viewer.js'],
  bundle: true,
  minify: true,
  format: 'iife',
  target: 'es2020',
  charset: 'ascii',
  legalComments: 'none',
  write: false,
});
// Messages of three.js name pages of the web, which a page without any request has no use for.
const code = made.outputFiles[0].text.replace(/https?:\/\/(?!www\.w3\.org)[^\s"'`)\\]*/g, '').trim();
if (/<\/script|<!--/i.test(code)) throw new Error('the bundle would end its own script element');
const text = `/*! three.js ${versionOf('three')}\n${licence}\n*/\n${code}\n`;
const lock = {
  file: 'viewer.min.js',
  sha256: createHash('sha256').update(text).digest('hex'),
  bytes: Buffer.byteLength(text),
  three: versionOf('three'),
  esbuild: versionOf('esbuild'),
  source_sha256: createHash('sha256').update(readFileSync(join(here, 'viewer.js'))).digest('hex'),
};
writeFileSync(join(out, 'viewer.min.js'), text);
writeFileSync(join(out, 'viewer.lock.json'), `${JSON.stringify(lock, null, 2)}\n`);
console.log(`${lock.bytes} bytes, sha256 ${lock.sha256}`);
