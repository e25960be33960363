//! The bins, cells, blocks and lists of a mesh: made once, then shared.
//!
//! In: triangles, edges, rest positions (metres). Out: [`Patches`].
//!
//! Method: the rest sheet is laid on its mean plane, axes along the shortest
//! side of the first triangle. A triangle is filed under the square cell that
//! holds its centroid, edges and points under that of their first triangle. On a graded grid
//! cells are those between its lines: squares would cut through them, and no block be convex.
//! A block of 2 x 2 bins or cells counts only if its triangles tile a convex
//! polygon: the map of the block to the plane has no fold and winds around
//! once, hence covers the polygon once.
//!
//! Fails: slow, 17 ms for 7200 triangles, which is why the patches of the last
//! few meshes are kept: a mesh met again costs a comparison.

use super::super::distance::{PairKind, closest};
use super::{Element, LANES, Lists, NONE, NearBins, NearCells, Patches, Place, Tight, adjacent};
use crate::base::Vector3;
use std::sync::{Arc, Mutex};

/// Width of a bin in cells, a cell being two triangles of mean area. Empirical:
/// 2 is the least for which bins that are no neighbours lie two cells apart.
const BIN_CELLS: i32 = 2;
/// Relative tolerance on flatness and on convexity at rest.
const FLAT: f64 = 1e-9;
/// Coordinates nearer than this part of a cell are of one line.
const LINE: f64 = 1e-6;
/// Lines whose widths differ by no more than this part are evenly spaced.
const UNEVEN: f64 = 1e-3;

/// The rest sheet on its mean plane, metres.
struct Chart {
    u: Vec<[f64; 2]>,
    normal: Vector3,
    cell_m: f64,
    /// The lines of an unevenly spaced grid along both axes, in rising order.
    lines: Option<[Vec<f64>; 2]>,
}

/// The distinct coordinates of a grid's points along both axes, if these are all crossings of such
/// lines and the lines are unevenly spaced.
fn uneven_lines(u: &[[f64; 2]], cell_m: f64) -> Option<[Vec<f64>; 2]> {
    let lines = [0, 1].map(|k| {
        let mut along: Vec<f64> = u.iter().map(|p| p[k]).collect();
        along.sort_unstable_by(f64::total_cmp);
        along.dedup_by(|b, a| *b - *a < LINE * cell_m);
        along
    });
    let uneven = |along: &Vec<f64>| {
        let widths = along.windows(2).map(|w| w[1] - w[0]);
        let (least, most) =
            widths.fold((f64::INFINITY, 0.0_f64), |(low, high), w| (low.min(w), high.max(w)));
        most > (1.0 + UNEVEN) * least
    };
    let grid = lines[0].len() * lines[1].len() == u.len();
    (grid && lines.iter().any(uneven)).then_some(lines)
}

impl Chart {
    fn new(triangles: &[[u32; 3]], rest: &[Vector3]) -> Self {
        let doubled = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| rest[v as usize]);
            (b - a).cross(&(c - a))
        };
        let normal = triangles.iter().map(doubled).sum::<Vector3>();
        let normal = normal.try_normalize(0.0).unwrap_or_else(Vector3::z);
        // along a yarn: the shortest side of a triangle is not the diagonal
        let sides = triangles.first().map(|t| {
            let [a, b, c] = t.map(|v| rest[v as usize]);
            [b - a, c - b, a - c]
        });
        let shortest = sides
            .and_then(|s| {
                s.into_iter().min_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()))
            })
            .unwrap_or_else(Vector3::x);
        let along = (shortest - normal * normal.dot(&shortest))
            .try_normalize(0.0)
            .unwrap_or_else(Vector3::x);
        let across = normal.cross(&along);
        let area = triangles.iter().map(|t| doubled(t).norm()).sum::<f64>();
        let cell_m = (area / triangles.len().max(1) as f64).sqrt();
        let u: Vec<_> = rest.iter().map(|p| [along.dot(p), across.dot(p)]).collect();
        let lines = uneven_lines(&u, cell_m);
        Chart { u, normal, cell_m, lines }
    }

    /// The place of the cell that a triangle is filed under; `corner` is the chart's lowest.
    fn place_of(&self, t: &[u32; 3], corner: [f64; 2]) -> Place {
        let Some(lines) = &self.lines else {
            return [0, 1].map(|k| {
                let sum = t.iter().map(|&v| self.u[v as usize][k] - corner[k]).sum::<f64>();
                (sum / (3.0 * self.cell_m)).floor() as i32
            });
        };
        [0, 1].map(|k| {
            let line = |v: u32| {
                let before = self.u[v as usize][k] - LINE * self.cell_m;
                lines[k].partition_point(|&at| at < before) as i32
            };
            t.iter().map(|&v| line(v)).sum::<i32>().div_euclid(3)
        })
    }

    /// Twice the signed area of a triangle, positive if its corners run counter-clockwise.
    fn area2(&self, [a, b, c]: [u32; 3]) -> f64 {
        let [a, b, c] = [a, b, c].map(|v| self.u[v as usize]);
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    }

    /// Of the boxes of two sets of vertices; no more than their distance.
    #[inline]
    fn box_gap_sq(&self, first: &[u32], second: &[u32]) -> f64 {
        let gap = |k: usize| {
            let range = |set: &[u32]| {
                set.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| {
                    let u = self.u[*v as usize][k];
                    [if u < low { u } else { low }, if u > high { u } else { high }]
                })
            };
            let ([a_low, a_high], [b_low, b_high]) = (range(first), range(second));
            (b_low - a_high).max(a_low - b_high).max(0.0)
        };
        gap(0).powi(2) + gap(1).powi(2)
    }

    /// Whether these triangles tile a convex polygon: all of them run counter-clockwise, and
    /// their outline is one loop that winds once and never bends to the right.
    fn tile_convex(&self, triangles: &[[u32; 3]]) -> bool {
        let tiny = FLAT * self.cell_m * self.cell_m;
        let mut sides: Vec<_> =
            triangles.iter().flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]).collect();
        sides.sort_unstable();
        let twice = sides.windows(2).any(|w| w[0] == w[1]);
        if twice || triangles.iter().any(|t| self.area2(*t) <= tiny) {
            return false;
        }
        let outer = |&&[from, to]: &&[u32; 2]| sides.binary_search(&[to, from]).is_err();
        let outline: Vec<_> = sides.iter().filter(outer).copied().collect();
        if outline.windows(2).any(|w| w[0][0] == w[1][0]) {
            return false;
        }
        let next = |a: u32| outline.binary_search_by_key(&a, |side| side[0]).map(|i| outline[i][1]);
        let rises = |a: u32, b: u32| {
            let (a, b) = (self.u[a as usize], self.u[b as usize]);
            b[1] > a[1] || (b[1] == a[1] && b[0] > a[0])
        };
        let Some(&[first, _]) = outline.first() else { return false };
        let (mut at, mut steps, mut windings) = (first, 0, 0);
        while steps == 0 || (at != first && steps <= outline.len()) {
            let Ok(b) = next(at) else { return false };
            let Ok(c) = next(b) else { return false };
            if self.area2([at, b, c]) < -tiny {
                return false;
            }
            windings += usize::from(!rises(at, b) && rises(b, c));
            (at, steps) = (b, steps + 1);
        }
        steps == outline.len() && windings == 1
    }
}

/// Index of each place.
struct Map(Vec<Entry>);

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Entry {
    place: Place,
    index: u32,
}

impl Map {
    fn new(places: &[Place]) -> Self {
        let numbered = places.iter().zip(0..);
        let mut map: Vec<_> = numbered.map(|(&place, index)| Entry { place, index }).collect();
        map.sort_unstable();
        Map(map)
    }

    fn get(&self, place: Place) -> Option<u32> {
        let found = self.0.binary_search_by_key(&place, |entry| entry.place).ok();
        found.map(|i| self.0[i].index)
    }

    /// Those of the 2 x 2 places up from `place` that are there.
    fn block(&self, [i, j]: Place) -> impl Iterator<Item = u32> + '_ {
        [[i, j], [i, j + 1], [i + 1, j], [i + 1, j + 1]].into_iter().filter_map(|at| self.get(at))
    }
}

/// The blocks at the lower corners `map` that hold two adjacent places.
fn holding(map: &Map, a: Place, b: Place) -> [u32; 4] {
    let mut blocks = [NONE; 4];
    let corners = [[-1, -1], [-1, 0], [0, -1], [0, 0]].map(|[i, j]| [a[0] + i, a[1] + j]);
    let holds = |at: &Place| (0..2).all(|k| (at[k]..=at[k] + 1).contains(&b[k]));
    for (slot, at) in blocks.iter_mut().zip(corners.into_iter().filter(holds)) {
        *slot = map.get(at).unwrap_or(NONE);
    }
    blocks
}

/// The meshes whose patches are kept; the oldest goes. A drape uses two.
const MESHES_KEPT: usize = 4;

/// A mesh with its patches.
struct Kept {
    triangles: Vec<[u32; 3]>,
    rest: Vec<Vector3>,
    least_m: f64,
    patches: Arc<Patches>,
}

impl Patches {
    /// The patches of a mesh; they are kept and shared, since every drape on a
    /// grid asks for the same. `edges`: sorted, ends sorted. `has_area[p]`:
    /// points without are left out. Pairs nearer than `least_m` at rest are none.
    pub fn shared(
        triangles: &[[u32; 3]],
        edges: &[[u32; 2]],
        has_area: &[bool],
        rest: &[Vector3],
        least_m: f64,
    ) -> Arc<Self> {
        static KEPT: Mutex<Vec<Kept>> = Mutex::new(Vec::new());
        let kept = || KEPT.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let same = |k: &&Kept| k.triangles == triangles && k.rest == rest && k.least_m == least_m;
        if let Some(found) = kept().iter().find(same) {
            return Arc::clone(&found.patches);
        }
        let patches = Arc::new(Self::new(triangles, edges, has_area, rest, least_m));
        let mut kept = kept();
        if kept.len() == MESHES_KEPT {
            kept.remove(0);
        }
        kept.push(Kept {
            triangles: triangles.to_vec(),
            rest: rest.to_vec(),
            least_m,
            patches: Arc::clone(&patches),
        });
        patches
    }

    fn new(
        triangles: &[[u32; 3]],
        edges: &[[u32; 2]],
        has_area: &[bool],
        rest: &[Vector3],
        least_m: f64,
    ) -> Self {
        let chart = Chart::new(triangles, rest);
        let corner =
            chart.u.iter().fold([f64::INFINITY; 2], |low, u| [low[0].min(u[0]), low[1].min(u[1])]);
        let place_of = |t: &[u32; 3]| chart.place_of(t, corner);
        let bin_of = |cell: Place| cell.map(|k| k.div_euclid(BIN_CELLS));
        let mut cell_places: Vec<Place> = triangles.iter().map(place_of).collect();
        cell_places.sort_unstable_by_key(|c| (bin_of(*c), *c));
        cell_places.dedup();
        let mut places: Vec<_> = cell_places.iter().map(|c| bin_of(*c)).collect();
        places.dedup();
        let (cell_map, bin_map) = (Map::new(&cell_places), Map::new(&places));
        let cell_of: Vec<_> = triangles.iter().map(|t| cell_map.get(place_of(t))).collect();
        let mut cell_of_point = vec![None; rest.len()];
        let mut cell_of_edge = vec![None; edges.len()];
        for (t, cell) in triangles.iter().zip(&cell_of) {
            for i in 0..3 {
                let (a, b) = (t[i], t[(i + 1) % 3]);
                if let Ok(e) = edges.binary_search(&[a.min(b), a.max(b)]) {
                    cell_of_edge[e] = cell_of_edge[e].or(*cell);
                }
                if has_area[a as usize] {
                    cell_of_point[a as usize] = cell_of_point[a as usize].or(*cell);
                }
            }
        }
        let bins: Vec<_> = cell_places.iter().map(|c| bin_map.get(bin_of(*c))).collect();
        let count = cell_places.len();
        let mut patches = Patches {
            cells: Lists::sorted(places.len(), &bins),
            triangles: Lists::sorted(count, &cell_of),
            edges: Lists::sorted(count, &cell_of_edge),
            points: Lists::sorted(count, &cell_of_point),
            vertices: Lists::new(),
            elements: Vec::new(),
            groups: Vec::new(),
            bin_blocks: Lists::new(),
            cell_blocks: Lists::new(),
            near_bins: Vec::new(),
            near_cells: Vec::new(),
            apart_cells: Vec::new(),
            tight: Vec::new(),
            loose_m: chart.cell_m * (1.0 - 1e-6),
            places,
        };
        patches.file_vertices(triangles);
        let slots = patches.file_elements(&chart, triangles, rest);
        let blocks =
            patches.file_blocks(&chart, triangles, &slots, [&bin_map, &cell_map], &cell_places);
        patches.pair_up(&chart, &bin_map, &cell_places, &blocks);
        patches.list_tight_pairs(&chart, triangles, edges, rest, least_m);
        patches
    }

    fn file_vertices(&mut self, triangles: &[[u32; 3]]) {
        for cell in 0..self.triangles.len() as u32 {
            let mut own: Vec<_> =
                self.triangles.of(cell).iter().flat_map(|&t| triangles[t as usize]).collect();
            own.sort_unstable();
            own.dedup();
            self.vertices.push(own);
        }
    }

    /// A triangle that is not flat on the chart gets a zero inverse, hence
    /// `F = 0` and `mu = 0` for its patches. Gives the slot of each triangle.
    fn file_elements(
        &mut self,
        chart: &Chart,
        triangles: &[[u32; 3]],
        rest: &[Vector3],
    ) -> Vec<u32> {
        let mut slots = vec![0; triangles.len()];
        for bin in 0..self.places.len() as u32 {
            let start = self.elements.len() / LANES;
            for &t in self.cells.of(bin).iter().flat_map(|c| self.triangles.of(*c)) {
                let corners = triangles[t as usize];
                let [a, b, c] = corners.map(|v| chart.u[v as usize]);
                let [p, q, r] = corners.map(|v| rest[v as usize]);
                let doubled = (q - p).cross(&(r - p));
                let flat = chart.normal.dot(&doubled) >= (1.0 - FLAT) * doubled.norm();
                let det = chart.area2(corners);
                let inverse = if flat && det > FLAT * chart.cell_m.powi(2) {
                    let m = [b[0] - a[0], c[0] - a[0], b[1] - a[1], c[1] - a[1]];
                    [m[3] / det, -m[1] / det, -m[2] / det, m[0] / det]
                } else {
                    [0.0; 4]
                };
                slots[t as usize] = self.elements.len() as u32;
                self.elements.push(Element { corners, inverse });
            }
            while !self.elements.len().is_multiple_of(LANES) {
                self.elements.push(self.elements[self.elements.len() - 1]);
            }
            self.groups.push(start as u32..(self.elements.len() / LANES) as u32);
        }
        slots
    }

    /// Blocks of bins and of cells that tile a convex region, by lower corner.
    fn file_blocks(
        &mut self,
        chart: &Chart,
        triangles: &[[u32; 3]],
        slots: &[u32],
        [bin_map, cell_map]: [&Map; 2],
        cell_places: &[Place],
    ) -> [Map; 2] {
        let usable = |all: &[u32]| {
            chart.tile_convex(&all.iter().map(|t| triangles[*t as usize]).collect::<Vec<_>>())
        };
        let (mut of_bins, mut of_cells) = (Vec::new(), Vec::new());
        for &at in &self.places {
            let cells = bin_map.block(at).flat_map(|b| self.cells.of(b));
            let all: Vec<_> = cells.flat_map(|c| self.triangles.of(*c)).copied().collect();
            if usable(&all) {
                of_bins.push(at);
                self.bin_blocks.push(bin_map.block(at));
            }
        }
        for &at in cell_places {
            let all: Vec<_> =
                cell_map.block(at).flat_map(|c| self.triangles.of(c)).copied().collect();
            if usable(&all) {
                of_cells.push(at);
                self.cell_blocks.push(all.iter().map(|t| slots[*t as usize]));
            }
        }
        [Map::new(&of_bins), Map::new(&of_cells)]
    }

    fn pair_up(&mut self, chart: &Chart, bin_map: &Map, cell_places: &[Place], blocks: &[Map; 2]) {
        for (a, &[i, j]) in self.places.iter().enumerate() {
            for (di, dj) in [(0, 0), (0, 1), (1, -1), (1, 0), (1, 1)] {
                let Some(b) = bin_map.get([i + di, j + dj]) else { continue };
                let first_near = self.near_cells.len() as u32;
                let first_apart = self.apart_cells.len() as u32;
                for &c in self.cells.of(a as u32) {
                    for &d in self.cells.of(b).iter().filter(|d| a as u32 != b || **d >= c) {
                        let (p, q) = (cell_places[c as usize], cell_places[d as usize]);
                        let hulls = [c, d].map(|cell| self.vertices.of(cell));
                        let loose_sq = self.loose_m * self.loose_m;
                        // the second only where triangles reach beyond their cell
                        if adjacent(p, q) || chart.box_gap_sq(hulls[0], hulls[1]) < loose_sq {
                            let blocks = holding(&blocks[1], p, q);
                            let cells = [c, d];
                            self.near_cells.push(NearCells {
                                cells,
                                blocks,
                                tight: 0..0,
                                tight_m: 0.0,
                            });
                        } else {
                            self.apart_cells.push([c, d]);
                        }
                    }
                }
                self.near_bins.push(NearBins {
                    blocks: holding(&blocks[0], [i, j], [i + di, j + dj]),
                    cells: first_near..self.near_cells.len() as u32,
                    apart: first_apart..self.apart_cells.len() as u32,
                    tight_m: 0.0,
                });
            }
        }
    }

    fn list_tight_pairs(
        &mut self,
        chart: &Chart,
        triangles: &[[u32; 3]],
        edges: &[[u32; 2]],
        rest: &[Vector3],
        least_m: f64,
    ) {
        let (loose_sq, least_sq) = (self.loose_m * self.loose_m, least_m * least_m);
        let Patches { near_cells, tight, edges: filed, triangles: faces, points, .. } = self;
        for near in near_cells {
            let start = tight.len() as u32;
            let mut least_found_sq = loose_sq;
            let mut keep = |kind, elements, corners: [u32; 4]| {
                let first = if kind == PairKind::EdgeEdge { 2 } else { 1 };
                if chart.box_gap_sq(&corners[..first], &corners[first..]) >= loose_sq {
                    return;
                }
                let found = closest(kind, &corners.map(|v| rest[v as usize]));
                let sq = found.distance_sq;
                if sq >= least_sq && sq < loose_sq {
                    least_found_sq = least_found_sq.min(sq);
                    tight.push(Tight { kind, elements, weights: found.weights });
                }
            };
            let [a, b] = near.cells;
            for (i, &e) in filed.of(a).iter().enumerate() {
                for &f in &filed.of(b)[if a == b { i + 1 } else { 0 }..] {
                    let (e, f) = (e.min(f), e.max(f));
                    let ([p, q], [r, s]) = (edges[e as usize], edges[f as usize]);
                    if p != r && p != s && q != r && q != s {
                        keep(PairKind::EdgeEdge, [e, f], [p, q, r, s]);
                    }
                }
            }
            for (from, to) in [(a, b), (b, a)].into_iter().take(if a == b { 1 } else { 2 }) {
                for &p in points.of(from) {
                    for &t in faces.of(to) {
                        let [u, v, w] = triangles[t as usize];
                        if ![u, v, w].contains(&p) {
                            keep(PairKind::PointTriangle, [p, t], [p, u, v, w]);
                        }
                    }
                }
            }
            near.tight = start..tight.len() as u32;
            near.tight_m = least_found_sq.sqrt();
        }
        for near in &mut self.near_bins {
            let cells = &self.near_cells[near.cells.start as usize..near.cells.end as usize];
            near.tight_m = cells.iter().map(|c| c.tight_m).fold(self.loose_m, f64::min);
        }
    }
}
