//! Relative coordinates: which rows of B are independent, and how the others follow from them.

use super::{Coupling, closure, mistake};
use crate::error::Diagnostic;
use crate::model::Train;
use nalgebra::{DMatrix, DVector};

/// A row whose remainder is smaller follows from the rows before it: rounding of arms typed with all digits.
const CLOSES: f64 = 1e-10;
/// A row whose remainder is larger is a coordinate of its own. In between a loop almost closes: a locked train, a typing error.
const OPEN: f64 = 1e-3;
/// A row that closes a loop with a remainder below this is accepted with a warning: a slip in a lever arm, more likely than a design.
const NEAR: f64 = 0.05;
/// Entries of W closer to 0 or 1 than this are rounding.
const ROUNDING: f64 = 1e-13;

/// Coupling of the bodies of a train.
///
/// ```text
/// r = P z,    deformations = W r,    W P = B,    B N = 0
/// ```
///
/// P: rows of B accepted in the order of the file while linearly independent. Independence is judged on rows and columns of
/// unit size, so that rad and m, large and small wheels compare and no inertia can make a train look like a loop;
/// a connection that closes no loop of the graph of bodies (ground included) is independent whatever the numbers.
/// Rows of W of accepted connections are exact unit vectors: for trains without loops W is exactly the identity.
///
/// # Errors
/// Each connection that nearly closes a loop (remainder between 1e-10 and 1e-3 of its row), with the mismatch.
pub fn couple(train: &Train) -> Result<Coupling, Vec<Diagnostic>> {
    let incidence = incidence(train);
    let (e, n_b) = incidence.shape();
    let balanced = Balanced::new(&incidence);
    let mut forest = Forest::new(n_b);
    let mut basis = Basis::default();
    let (mut coordinates, mut dependent, mut list) = (Vec::new(), Vec::new(), Vec::new());
    let mut warnings = Vec::new();
    for k in 0..e {
        let row = balanced.rows.row(k).transpose();
        let is_branch = forest.join(&row);
        let (share, remainder) = basis.project(&row);
        let size = remainder.norm();
        if is_branch || size >= OPEN {
            if !is_branch {
                forest.lock(&row);
                if size < NEAR {
                    let w = basis.combination(&share);
                    let near = nearly_closes(train, k, size, &coordinates, &w);
                    let help = near.help.unwrap_or_default();
                    warnings.push(format!("{} {}; {help}", near.path, near.message));
                }
            }
            basis.push(share, remainder, size);
            coordinates.push(k);
        } else if size > CLOSES {
            let w = basis.combination(&share);
            list.push(nearly_closes(train, k, size, &coordinates, &w));
        } else {
            dependent.push((k, basis.combination(&share)));
        }
    }
    if !list.is_empty() {
        return Err(list);
    }
    let element_map = element_map(&balanced, &coordinates, dependent);
    let transform = incidence.select_rows(&coordinates);
    let scatter = &element_map * &transform - &incidence;
    for (k, row) in scatter.row_iter().enumerate() {
        // Only a badly conditioned loop gets here: its remainder was accepted above.
        if row.norm() > 10.0 * CLOSES * incidence.row(k).norm() {
            let w = element_map.row(k).iter().copied().collect::<Vec<_>>();
            let mismatch = row.norm() / incidence.row(k).norm();
            list.push(nearly_closes(train, k, mismatch, &coordinates, &w));
        }
    }
    if !list.is_empty() {
        return Err(list);
    }
    let rigid_body = balanced.restore(basis.complement(n_b));
    if warnings.is_empty() && rigid_body.ncols() == 0 {
        warnings.extend(closure::locked(train));
    }
    Ok(Coupling {
        warnings,
        incidence,
        transform,
        element_map,
        rigid_body,
        coordinates,
    })
}

/// W, e x n, from the combinations of the dependent rows; rounding is cleaned away.
fn element_map(
    balanced: &Balanced,
    coordinates: &[usize],
    dependent: Vec<(usize, Vec<f64>)>,
) -> DMatrix<f64> {
    let mut map = DMatrix::zeros(balanced.size.len(), coordinates.len());
    for (i, k) in coordinates.iter().enumerate() {
        map[(*k, i)] = 1.0;
    }
    for (k, w) in dependent {
        let largest = w.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        for (i, x) in w.into_iter().enumerate() {
            let x = if x.abs() <= ROUNDING * largest {
                0.0
            } else {
                x
            };
            let x = x * balanced.size[k] / balanced.size[coordinates[i]];
            let is_one = (x.abs() - 1.0).abs() <= ROUNDING;
            map[(k, i)] = if is_one { x.signum() } else { x };
        }
    }
    map
}

/// B, e x n_b: one row of lever arms a connection.
fn incidence(train: &Train) -> DMatrix<f64> {
    let mut b = DMatrix::zeros(train.connections.len(), train.bodies.len());
    for (k, connection) in train.connections.values().enumerate() {
        for (body, arm) in &connection.arms {
            b[(k, *body)] += arm;
        }
    }
    b
}

fn nearly_closes(
    train: &Train,
    k: usize,
    mismatch: f64,
    coordinates: &[usize],
    w: &[f64],
) -> Diagnostic {
    let name = |k: usize| {
        let found = train.connections.get_index(k);
        found.map_or("", |(name, _)| name.as_str())
    };
    let largest = w.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let partners: Vec<&str> = (coordinates.iter().zip(w))
        .filter(|(_, w)| w.abs() > 1e-6 * largest)
        .map(|(k, _)| name(*k))
        .collect();
    let message = format!(
        "nearly closes a loop with {}: its lever arms differ from those of the others by {mismatch:.2e} of the row",
        partners.join(", ")
    );
    let involved = (coordinates.iter().zip(w))
        .filter(|(_, w)| w.abs() > 1e-6 * largest)
        .map(|(k, _)| *k);
    let involved: Vec<usize> = involved.chain([k]).collect();
    let help = format!(
        "write the ratios around the loop exactly (all digits of each radius); a train that does not close is locked{}",
        closure::suggestion(train, &involved)
    );
    mistake(format!("connections.{}", name(k)), message, Some(help))
}

/// B with rows and columns of unit size: B = diag(size) rows diag(column).
struct Balanced {
    rows: DMatrix<f64>,
    size: Vec<f64>,
    column: Vec<f64>,
}

impl Balanced {
    fn new(incidence: &DMatrix<f64>) -> Balanced {
        let mut rows = incidence.clone();
        let mut size: Vec<f64> = rows.row_iter().map(|row| row.norm()).collect();
        for (mut row, size) in rows.row_iter_mut().zip(&size) {
            row /= *size;
        }
        let column: Vec<f64> = rows
            .column_iter()
            .map(|c| if c.amax() > 0.0 { c.amax() } else { 1.0 })
            .collect();
        for (mut c, scale) in rows.column_iter_mut().zip(&column) {
            c /= *scale;
        }
        for (mut row, size) in rows.row_iter_mut().zip(&mut size) {
            let norm = row.norm();
            row /= norm;
            *size *= norm;
        }
        Balanced { rows, size, column }
    }

    /// A basis of the null space of B from one of the balanced rows, each motion with entries 1 where the others have 0.
    fn restore(&self, mut null: DMatrix<f64>) -> DMatrix<f64> {
        for (mut row, scale) in null.row_iter_mut().zip(&self.column) {
            row /= *scale;
        }
        let mut first = 0;
        for j in 0..null.ncols() {
            // Gauss-Jordan on columns; the first body with a sizeable entry becomes the reference of motion j.
            let rest = null.columns(j, null.ncols() - j).clone_owned();
            let largest = rest.amax();
            let Some(body) = (first..null.nrows()).find(|i| rest.row(*i).amax() > 1e-8 * largest)
            else {
                break;
            };
            let best = (j..null.ncols())
                .max_by(|a, b| null[(body, *a)].abs().total_cmp(&null[(body, *b)].abs()));
            null.swap_columns(j, best.unwrap_or(j));
            let pivot = null[(body, j)];
            let mut motion = null.column_mut(j);
            motion /= pivot;
            let reference = null.column(j).clone_owned();
            for i in (0..null.ncols()).filter(|i| *i != j) {
                let factor = null[(body, i)];
                null.column_mut(i).axpy(-factor, &reference, 1.0);
            }
            first = body + 1;
        }
        for mut column in null.column_iter_mut() {
            let largest = column.amax();
            column.apply(|x| {
                *x = if x.abs() <= ROUNDING * largest {
                    0.0
                } else {
                    *x
                }
            });
        }
        null
    }
}

/// Orthonormal vectors v with accepted row i = sum over k <= i of lower[i][k] v_k.
#[derive(Default)]
struct Basis {
    vectors: Vec<DVector<f64>>,
    lower: Vec<Vec<f64>>,
}

impl Basis {
    /// Parts of a row along the vectors, and what remains; orthogonalised twice.
    fn project(&self, row: &DVector<f64>) -> (Vec<f64>, DVector<f64>) {
        let mut rest = row.clone();
        let mut share = vec![0.0; self.vectors.len()];
        for _ in 0..2 {
            for (s, v) in share.iter_mut().zip(&self.vectors) {
                let part = v.dot(&rest);
                if part != 0.0 {
                    rest.axpy(-part, v, 1.0);
                    *s += part;
                }
            }
        }
        (share, rest)
    }

    fn push(&mut self, mut share: Vec<f64>, remainder: DVector<f64>, size: f64) {
        share.push(size);
        self.lower.push(share);
        self.vectors.push(remainder / size);
    }

    /// w with sum over i of w_i (accepted row i) = sum over k of share_k v_k: back substitution.
    fn combination(&self, share: &[f64]) -> Vec<f64> {
        let mut w = share.to_vec();
        for i in (0..w.len()).rev() {
            w[i] /= self.lower[i][i];
            for k in 0..i {
                w[k] -= w[i] * self.lower[i][k];
            }
        }
        w
    }

    /// Orthonormal complement of the vectors, n_b x (n_b - n).
    fn complement(mut self, n_b: usize) -> DMatrix<f64> {
        let n = self.vectors.len();
        // Squared distance of every unit vector from the span; the farthest one is taken next.
        let mut distance = DVector::from_element(n_b, 1.0);
        for v in &self.vectors {
            distance -= v.component_mul(v);
        }
        for _ in n..n_b {
            let mut unit = DVector::zeros(n_b);
            unit[distance.imax()] = 1.0;
            let (share, remainder) = self.project(&unit);
            let size = remainder.norm();
            self.push(share, remainder, size);
            let v = &self.vectors[self.vectors.len() - 1];
            distance -= v.component_mul(v);
        }
        DMatrix::from_fn(n_b, n_b - n, |i, j| self.vectors[n + j][i])
    }
}

/// Which bodies hang together, ground included, and whether only two-armed connections tie them: then each is a tree or has loops
/// of known closure, and a connection between two of them is independent.
struct Forest {
    parent: Vec<usize>,
    is_seen: Vec<bool>,
    is_simple: Vec<bool>,
}

impl Forest {
    fn new(n_b: usize) -> Forest {
        Forest {
            parent: (0..=n_b).collect(),
            is_seen: vec![false; n_b],
            is_simple: vec![true; n_b + 1],
        }
    }

    fn root(&mut self, mut node: usize) -> usize {
        while self.parent[node] != node {
            self.parent[node] = self.parent[self.parent[node]];
            node = self.parent[node];
        }
        node
    }

    /// Adds a connection; true when it closes no loop.
    fn join(&mut self, row: &DVector<f64>) -> bool {
        let ground = self.is_seen.len();
        let mut nodes: Vec<usize> = (0..ground).filter(|k| row[*k] != 0.0).collect();
        let has_new_body = nodes.iter().any(|k| !self.is_seen[*k]);
        nodes.iter().for_each(|k| self.is_seen[*k] = true);
        if nodes.len() == 1 {
            nodes.push(ground);
        }
        let roots: Vec<usize> = nodes.iter().map(|k| self.root(*k)).collect();
        let is_pair = roots.len() == 2;
        let is_simple = is_pair && roots.iter().all(|r| self.is_simple[*r]);
        let is_branch = has_new_body || (is_simple && roots[0] != roots[1]);
        for r in &roots[1..] {
            let top = self.root(roots[0]);
            let other = self.root(*r);
            self.parent[other] = top;
        }
        let top = self.root(roots[0]);
        self.is_simple[top] = is_simple;
        is_branch
    }

    /// Notes that the last connection closed a loop without following from the others: its bodies are locked, as if grounded.
    fn lock(&mut self, row: &DVector<f64>) {
        if let Some(body) = (0..row.len()).find(|k| row[*k] != 0.0) {
            let top = self.root(body);
            self.is_simple[top] = false;
        }
    }
}
