#!/usr/bin/env bash
# Processor time, stage by stage, of PCL, Open3D and scan2params on the same million
# noisy points of a drape, in one run on one thread. Prints a table for
# docs/validation/peers.md. Needs Debian (libpcl-dev, pkg-config, g++; installs what is missing
# when run as root) and Python 3.11 or later for Open3D.
#
#     scripts/compare_peers.sh [DRAPE.obj]
set -euo pipefail
cd "$(dirname "$0")/.."
drape=${1:-}
work=target/peers
open3d=open3d-cpu==0.20.0
mkdir -p "$work"

if ! dpkg -s libpcl-dev pkg-config g++ >/dev/null 2>&1; then
    apt-get update -qq
    DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends \
        libpcl-dev pkg-config g++ >&2
fi
# PCL's CMake package asks for all of VTK and MPI; pkg-config for what is used.
parts="pcl_common pcl_io pcl_filters pcl_features pcl_search pcl_segmentation pcl_kdtree"
if [ ! -x "$work/pcl_stages" ] || [ scripts/peers/pcl_stages.cpp -nt "$work/pcl_stages" ]; then
    # shellcheck disable=SC2046,SC2086
    g++ -O3 -DNDEBUG -w -std=c++17 $(pkg-config --cflags $parts) -o "$work/pcl_stages" \
        scripts/peers/pcl_stages.cpp $(pkg-config --libs $parts) -lboost_system
fi
if ! "$work/venv/bin/python" -c 'import open3d' 2>/dev/null; then
    python3 -m venv "$work/venv"
    "$work/venv/bin/pip" install --quiet --disable-pip-version-check "$open3d"
fi
profile=${PROFILE:-release}
if [ "$profile" = release ]; then release=--release; else release=; fi
# shellcheck disable=SC2086
cargo build --quiet $release -p scan2params -p scan2params-lab
ours=target/$([ "$profile" = release ] && echo release || echo debug)/scan2params

if [ -z "$drape" ]; then
    drape=$work/mean.obj
    [ -f "$drape" ] || "$ours" simulate --params fixtures/drapes/mean.params.json --seed 2 --out "$drape" >&2
fi
cloud=$work/million.ply
"$ours" augment "$drape" --even 1000000 --seed 1 --out "$cloud" >&2

export OMP_NUM_THREADS=1 RAYON_NUM_THREADS=1
# Each three times, turn about, so that the machine's other work meets all alike.
for run in 1 2 3; do
    for floor in all above; do
        "$work/pcl_stages" "$cloud" $floor >"$work/pcl-$floor.$run.csv"
        "$work/venv/bin/python" scripts/peers/open3d_stages.py "$cloud" $floor \
            >"$work/open3d-$floor.$run.csv"
    done
    "$ours-lab" stages "$cloud" --warp-toward +x --repeat 1 >"$work/ours.$run.csv"
done
"$work/venv/bin/python" scripts/peers/table.py "$work"
