//! Orthotropic bending on the grid.
//!
//! The plate energy of a sheet that bends about any direction,
//!
//! `E = 1/2 integral [ B^u k_uu^2 + B^v k_vv^2 + 2 D12 k_uu k_vv + 4 D66 k_uv^2 ]`  \[J\]
//!
//! with D3 = D12 + 2 D66 = 2 B^h - (B^u + B^v) / 2, so that bending about a
//! 45 degree line has stiffness B^h. For an isometric sheet the second derivatives
//! of position are normal to it and their products are the curvatures' products
//! (Bergou et al. 2006, "A quadratic bending model for inextensible surfaces"),
//! so the energy is
//!
//! `1/2 integral [ B^u |x_uu|^2 + B^v |x_vv|^2 + 2 D12 x_uu . x_vv + 4 D66 |x_uv|^2 ]`
//!
//! quadratic in the positions: its Hessian is constant, positive semidefinite and
//! the same for x, y and z. On the grid x_uu and x_vv are second differences at
//! vertices, x_uv the twist of a cell. No diagonal enters; an imposed cylinder
//! costs its nominal energy to second order at every angle (tested below), where
//! the hinge weight 3 B/A costs 3 to 9 times too much.
//!
//! On a grid rotated against the yarns the same energy in the grid's own second
//! differences has all six coefficients (`PlateRigidity::on`), D16 and D26 among
//! them. Those couple the differences along one side, at a vertex, with the mean twist
//! of the cells around it; the twist's square stays with the cells, whose mean square
//! is never below the square of their mean, so that the whole stays positive.
//!
//! On uneven lines x_uu and x_vv are the second derivatives of the parabola through three
//! vertices, which is of second order where widths change smoothly.
//!
//! Stretch adds |d strain/du|^2 to |x_uu|^2: at 5 mm and Table 2's mean this is
//! 3e-4 of the membrane's own stiffness. Only D3 acts on developable shapes; the
//! split into D12 and D66 is a choice (see [`PlateRigidity::new`]).

use super::Energy;
use crate::base::Vector3;
use crate::fabric::Fabric;
use crate::numeric::sparse::{BlockPattern, BlockSlot};
use crate::sim::grid::{Grid, MaterialFrame};

/// The four constants of the orthotropic plate energy \[N m\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlateRigidity {
    /// Rigidity against curvature along the weft, B^u.
    pub weft_nm: f64,
    /// Rigidity against curvature along the warp, B^v.
    pub warp_nm: f64,
    /// Coupling of the two curvatures, D12.
    pub coupling_nm: f64,
    /// Rigidity against twist, D66.
    pub twist_nm: f64,
}

impl PlateRigidity {
    /// The constants of a fabric's three measured bending stiffnesses. D3 is split so that there is
    /// no coupling (a woven or knitted sheet has hardly any) as long as that leaves D66 at least
    /// 1 % of sqrt(B^u B^v); below that the coupling is negative.
    ///
    /// The energy is positive only while B^h >= (sqrt B^u - sqrt B^v)^2 / 4; `Fabric::check`
    /// refuses other fabrics.
    #[must_use]
    pub fn new(fabric: &Fabric) -> Self {
        let (weft, warp) = (fabric.bending_weft_nm, fabric.bending_warp_nm);
        let mean = (weft * warp).sqrt();
        let d3 = 2.0 * fabric.bending_bias_nm - 0.5 * (weft + warp);
        let twist = (0.5 * d3).max(0.01 * mean);
        let coupling = (d3 - 2.0 * twist).clamp(-mean, 0.0);
        Self { weft_nm: weft, warp_nm: warp, coupling_nm: coupling, twist_nm: twist }
    }
}

/// The coefficients of `1/2 sum` over the grid's second differences, along i (`ii`),
/// along j (`jj`) and mixed (`ij`), times the spacing to the fourth over the mean area of
/// a cell \[N m\].
#[derive(Clone, Copy, Debug, PartialEq)]
struct GridRigidity {
    ii: f64,
    jj: f64,
    ij: f64,
    ii_jj: f64,
    ii_ij: f64,
    jj_ij: f64,
}

impl PlateRigidity {
    /// The same energy in second differences along the grid's own directions.
    fn on(&self, frame: &MaterialFrame) -> GridRigidity {
        let [[ui, uj], [vi, vj]] = frame.derivatives();
        // x_uu, x_vv, x_uv by (ii, jj, ij)
        let weft = [ui * ui, uj * uj, 2.0 * ui * uj];
        let warp = [vi * vi, vj * vj, 2.0 * vi * vj];
        let twist = [ui * vi, uj * vj, ui * vj + uj * vi];
        let form = |a: usize, b: usize| {
            self.weft_nm * (weft[a] * weft[b])
                + self.warp_nm * (warp[a] * warp[b])
                + self.coupling_nm * (weft[a] * warp[b] + weft[b] * warp[a])
                + 4.0 * self.twist_nm * (twist[a] * twist[b])
        };
        GridRigidity {
            ii: form(0, 0),
            jj: form(1, 1),
            ij: form(2, 2),
            ii_jj: form(0, 1),
            ii_ij: form(0, 2),
            jj_ij: form(1, 2),
        }
    }
}

/// The constant bending matrix of a grid: one scalar for each pair of vertices,
/// times the identity in x, y, z.
#[derive(Clone, Debug)]
pub struct Bending {
    diagonal: Vec<f64>,
    pairs: Vec<Pair>,
}

#[derive(Clone, Copy, Debug)]
struct Pair {
    row: u32,
    column: u32,
    slot: BlockSlot,
    value: f64,
}

/// The lower half of a matrix whose rows reach two lines of vertices back.
struct Sums {
    n: usize,
    rows: Vec<[f64; WINDOW]>,
}

/// Lines of vertices that a second difference and the twist next to it lie apart at most.
const REACH: usize = 2;
/// Vertices of a row's square window, up to its own line.
const WINDOW: usize = (REACH + 1) * (2 * REACH + 1);

impl Sums {
    fn of(grid: &Grid) -> Self {
        Self { n: grid.n, rows: vec![[0.0; WINDOW]; grid.vertices()] }
    }

    /// Adds to an entry, but for those above the diagonal, which are those below it again.
    fn add(&mut self, row: usize, column: usize, value: f64) {
        if row < column {
            return;
        }
        let n = self.n;
        let lines_back = row / n - column / n;
        let along = column % n + REACH - row % n;
        self.rows[row][(REACH - lines_back) * (2 * REACH + 1) + along] += value;
    }

    /// Row, column and value of what is not zero, in their order.
    fn entries(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        let n = self.n;
        self.rows.iter().enumerate().flat_map(move |(row, window)| {
            let filled = window.iter().enumerate().filter(|(_, value)| **value != 0.0);
            filled.map(move |(place, &value)| {
                let (line, along) = (place / (2 * REACH + 1), place % (2 * REACH + 1));
                (row, row + along - REACH - (REACH - line) * n, value)
            })
        })
    }
}

/// The mixed derivative of cell `k`, times the square of the spacing, as weights of its corners.
pub(super) fn twist_of(grid: &Grid, k: usize) -> [(usize, f64); 4] {
    let [a, b, c, d] = grid.cells[k].map(|v| v as usize);
    let one = 1.0 / grid.cell_size(k);
    [(a, one), (b, -one), (c, -one), (d, one)]
}

/// The mean of the twists of the cells around a vertex, over their areas.
pub(super) fn mean_twist(grid: &Grid, around: &[u32]) -> Vec<(usize, f64)> {
    let whole: f64 = around.iter().map(|&c| grid.cell_size(c as usize)).sum();
    let of = |c: usize| {
        let part = grid.cell_size(c) / whole;
        twist_of(grid, c).map(|(v, weight)| (v, weight * part))
    };
    around.iter().flat_map(|&c| of(c as usize)).collect()
}

impl Bending {
    /// Assembles the bending matrix of a grid.
    #[must_use]
    pub fn new(grid: &Grid, rigidity: &PlateRigidity) -> Self {
        Self::scaled(grid, rigidity, |_| 1.0)
    }

    /// The same with `factor` times the rigidity at each vertex, and times the mean of its corners
    /// in a cell.
    #[must_use]
    pub fn scaled(grid: &Grid, rigidity: &PlateRigidity, factor: impl Fn(usize) -> f64) -> Self {
        let mut sums = Sums::of(grid);
        let mut add = |a: &[(usize, f64)], b: &[(usize, f64)], weight: f64| {
            for &(p, u) in a {
                for &(q, v) in b {
                    // symmetrised: 1/2 (a b^T + b a^T)
                    sums.add(p, q, 0.5 * weight * u * v);
                    sums.add(q, p, 0.5 * weight * u * v);
                }
            }
        };
        let n = grid.n;
        let rigidity = rigidity.on(&grid.frame);
        // area / h^4 for a whole cell
        let unit = grid.spacing_m.powi(-2) * grid.frame.area();
        let around = grid.cells_around();
        for vertex in 0..grid.vertices() {
            let share = grid.share(vertex) * factor(vertex);
            let (along_i, along_j) = (grid.second(vertex, n), grid.second(vertex, 1));
            if let Some(j) = &along_j {
                add(j, j, rigidity.jj * unit * share);
            }
            if let Some(i) = &along_i {
                add(i, i, rigidity.ii * unit * share);
            }
            if let (Some(i), Some(j), true) = (&along_i, &along_j, rigidity.ii_jj != 0.0) {
                add(j, i, 2.0 * rigidity.ii_jj * unit * share);
            }
            for (along, value) in [(along_i, rigidity.ii_ij), (along_j, rigidity.jj_ij)] {
                if let Some(second) = along.filter(|_| value != 0.0) {
                    let twist = mean_twist(grid, &around[vertex]);
                    add(&second, &twist, 2.0 * value * unit * share);
                }
            }
        }
        for (cell, fraction) in grid.volume_fraction.iter().enumerate() {
            let twist = twist_of(grid, cell);
            let mean = 0.25 * grid.cells[cell].map(|v| factor(v as usize)).iter().sum::<f64>();
            add(&twist, &twist, rigidity.ij * unit * (fraction * grid.cell_size(cell) * mean));
        }
        let mut bending = Self { diagonal: vec![0.0; grid.vertices()], pairs: Vec::new() };
        for (row, column, value) in sums.entries() {
            if row == column {
                bending.diagonal[row] = value;
            } else if let Some(slot) = grid.analysis.pattern().slot(row, column) {
                let (row, column) = (row as u32, column as u32);
                bending.pairs.push(Pair { row, column, slot, value });
            }
        }
        bending
    }
}

impl Energy for Bending {
    /// By differences of positions, as the gradient.
    fn energy_j(&self, _: &Grid, x: &[Vector3]) -> f64 {
        let squares = self
            .pairs
            .iter()
            .map(|p| p.value * (x[p.row as usize] - x[p.column as usize]).norm_squared());
        -0.5 * squares.sum::<f64>()
    }

    /// K x. The rows of K sum to zero, so that differences of positions are enough, and no digits
    /// are lost in large terms that cancel.
    fn add_gradient(&self, _: &Grid, x: &[Vector3], gradient: &mut [Vector3]) {
        for pair in &self.pairs {
            let (r, c) = (pair.row as usize, pair.column as usize);
            let force = (x[c] - x[r]) * pair.value;
            gradient[r] += force;
            gradient[c] -= force;
        }
    }

    fn add_constant_hessian(&self, grid: &Grid, values: &mut [f64]) {
        let pattern = grid.analysis.pattern();
        let identity = nalgebra::Matrix3::identity();
        for (vertex, &d) in self.diagonal.iter().enumerate() {
            pattern.add_diagonal(values, vertex, &(identity * d));
        }
        for pair in &self.pairs {
            BlockPattern::add_block(values, pair.slot, &(identity * pair.value));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::energy::difference::cylinder;

    fn fabric(weft: f64, warp: f64, bias: f64) -> Fabric {
        Fabric::from_paper_units([1e5, 1e5, 1e5, weft, warp, bias, 200.0])
    }

    /// Energy per area, over the cells away from the border, of the sheet bent to
    /// a cylinder about a line at `degrees` from the warp.
    fn cylinder_energy(fabric: &Fabric, degrees: f64, curvature: f64, n: usize) -> f64 {
        // the difference of two sizes leaves out the border's missing half stencils
        let of = |n: usize, side: f64| {
            let grid = Grid::shared(n, side);
            let bending = Bending::new(&grid, &PlateRigidity::new(fabric));
            bending.energy_j(&grid, &cylinder(&grid, degrees, curvature))
        };
        let h = 0.1 / (n - 1) as f64;
        // E(m) = e (m h)^2 + border (m h) + corner: second difference in m
        let m = n - 1;
        let second = of(m + 3, h * (m + 2) as f64) - 2.0 * of(m + 2, h * (m + 1) as f64)
            + of(m + 1, h * m as f64);
        second / (2.0 * h * h)
    }

    #[test]
    fn an_imposed_cylinder_costs_its_nominal_energy_at_every_angle() {
        let set = fabric(1119.74, 2370.87, 1245.30);
        let (u, v) = (set.bending_weft_nm, set.bending_warp_nm);
        let d3 = 2.0 * set.bending_bias_nm - 0.5 * (u + v);
        let curvature = 20.0;
        for degrees in [0.0_f64, 30.0, 45.0, 60.0, 90.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let nominal = u * cos.powi(4) + v * sin.powi(4) + 2.0 * d3 * sin.powi(2) * cos.powi(2);
            let measured = 2.0 * cylinder_energy(&set, degrees, curvature, 21) / curvature.powi(2);
            let error = measured / nominal - 1.0;
            // second differences of a circle: -(k h)^2 / 12 to -(k h)^2 / 6
            let bound = (curvature * 0.005_f64).powi(2) / 5.0;
            assert!(error.abs() < bound, "{degrees} degrees: {error:e} above {bound:e}");
        }
    }

    #[test]
    fn an_imposed_cylinder_costs_its_nominal_energy_on_uneven_lines_too() {
        let set = fabric(1119.74, 2370.87, 1245.30);
        let (u, v) = (set.bending_weft_nm, set.bending_warp_nm);
        let d3 = 2.0 * set.bending_bias_nm - 0.5 * (u + v);
        let curvature = 20.0;
        let energy = |grid: &Grid, degrees: f64| {
            let x = cylinder(grid, degrees, curvature);
            Bending::new(grid, &PlateRigidity::new(&set)).energy_j(grid, &x)
        };
        let cases = [(0.0, 0.0), (45.0, 0.0), (90.0, 0.0), (45.0, 0.3)];
        for (degrees, warp_rad) in cases {
            let (sin, cos) = f64::to_radians(degrees).sin_cos();
            let nominal = u * cos.powi(4) + v * sin.powi(4) + 2.0 * d3 * (sin * cos).powi(2);
            let grid = Grid::uneven_strip(81, 81, 0.00125, warp_rad);
            // about a line at `degrees` from the yarns, not from the lines
            let measured = energy(&grid, degrees - f64::to_degrees(warp_rad));
            let error = measured / (0.5 * nominal * curvature.powi(2) * 0.01) - 1.0;
            // the border's missing stencils: 1/80 a side
            assert!(error < 1e-3 && error > -0.05, "{degrees} {warp_rad}: {error:e}");
        }
    }

    #[test]
    fn no_shape_has_negative_energy_on_uneven_lines_rotated_against_the_yarns() {
        let grid = Grid::uneven_strip(9, 11, 0.005, 0.6);
        let bending = Bending::new(&grid, &PlateRigidity::new(&fabric(1000.0, 4000.0, 300.0)));
        for seed in 0..200_u32 {
            let shape = |v: usize| (v as f64 * (1.0 + 0.37 * f64::from(seed))).sin();
            let x: Vec<_> = (0..99).map(|v| Vector3::new(0.0, shape(v), 0.0)).collect();
            assert!(bending.energy_j(&grid, &x) > 0.0, "{seed}");
        }
    }

    #[test]
    fn bias_alone_moves_the_45_degree_cylinder_alone() {
        let (a, b) = (fabric(1000.0, 1500.0, 1250.0), fabric(1000.0, 1500.0, 2000.0));
        let ratio = |degrees| {
            cylinder_energy(&b, degrees, 20.0, 21) / cylinder_energy(&a, degrees, 20.0, 21)
        };
        assert!((ratio(0.0) - 1.0).abs() < 1e-6);
        assert!((ratio(90.0) - 1.0).abs() < 1e-6);
        assert!((ratio(45.0) - 1.6).abs() < 1e-3, "{}", ratio(45.0));
    }

    #[test]
    fn the_least_bias_stiffness_is_still_positive() {
        let (u, v) = (1000.0_f64, 4000.0_f64);
        let least = (u.sqrt() - v.sqrt()).powi(2) / 4.0;
        let rigidity = PlateRigidity::new(&fabric(u, v, least));
        assert!(
            rigidity.coupling_nm.powi(2) <= rigidity.weft_nm * rigidity.warp_nm * (1.0 + 1e-12)
        );
        assert!(rigidity.twist_nm > 0.0);
    }

    #[test]
    fn gradient_and_hessian_agree_with_the_energy() {
        let grid = Grid::shared(9, 0.3);
        let bending = Bending::new(&grid, &PlateRigidity::new(&fabric(1000.0, 1500.0, 300.0)));
        let x: Vec<_> =
            (0..81).map(|k| Vector3::from_fn(|c, _| (k as f64 * 1.7 + c as f64).sin())).collect();
        let mut gradient = vec![Vector3::zeros(); 81];
        bending.add_gradient(&grid, &x, &mut gradient);
        let work: f64 = x.iter().zip(&gradient).map(|(a, b)| a.dot(b)).sum();
        assert!((0.5 * work / bending.energy_j(&grid, &x) - 1.0).abs() < 1e-12);
        let pattern = grid.analysis.pattern();
        let mut values = vec![0.0; pattern.nonzeros()];
        bending.add_constant_hessian(&grid, &mut values);
        let mut product = vec![Vector3::zeros(); 81];
        pattern.multiply(&values, &x, &mut product);
        let error = product.iter().zip(&gradient).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(error < 1e-12 * gradient[40].norm().max(1e-6), "{error:e}");
    }

    #[test]
    fn differences_give_what_the_matrix_gives() {
        for grid in [Grid::shared(11, 0.1), Grid::uneven_strip(11, 11, 0.01, 0.0)] {
            differences_give_the_matrix_s(&grid);
        }
    }

    fn differences_give_the_matrix_s(grid: &Grid) {
        let bending = Bending::new(grid, &PlateRigidity::new(&fabric(900.0, 2000.0, 1300.0)));
        let pattern = grid.analysis.pattern();
        let mut values = vec![0.0; pattern.nonzeros()];
        bending.add_constant_hessian(grid, &mut values);
        let x: Vec<_> = (0..grid.vertices())
            .map(|v| grid.flat(v) + Vector3::new(0.0, (v as f64).sin() * 2e-3, 0.01))
            .collect();
        let (mut product, mut gradient) = (x.clone(), vec![Vector3::zeros(); x.len()]);
        pattern.multiply(&values, &x, &mut product);
        bending.add_gradient(grid, &x, &mut gradient);
        let energy: f64 = 0.5 * x.iter().zip(&product).map(|(a, b)| a.dot(b)).sum::<f64>();
        assert!((bending.energy_j(grid, &x) / energy - 1.0).abs() < 1e-12, "{energy}");
        let largest = product.iter().map(Vector3::norm).fold(0.0, f64::max);
        let off = product.iter().zip(&gradient).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(off < 1e-12 * largest, "{off:e} of {largest:e}");
        // where all is shifted far away the matrix loses digits, the differences do not
        let far: Vec<_> = x.iter().map(|p| p + Vector3::repeat(100.0)).collect();
        assert!((bending.energy_j(grid, &far) / energy - 1.0).abs() < 1e-9);
    }
}
