//! The cheapest cut between two nodes of an undirected network: maximum flow by
//! Dinic's algorithm (E. A. Dinic 1970), levels by breadth, blocking flows by depth.
//!
//! petgraph's `dinics` was tried: it clears its marks for every augmenting path, and
//! took 35 s on the 240,000 triangles of a shell that this cuts in one.

/// An undirected network with capacities.
pub struct Network {
    nodes: usize,
    /// Both directions of edge e are the arcs 2 e and 2 e + 1: where they lead, and
    /// what they can still take.
    to: Vec<u32>,
    left: Vec<u64>,
}

impl Network {
    /// A network of the nodes 0 to `nodes` - 1, without edges.
    #[must_use]
    pub fn new(nodes: usize) -> Self {
        Self { nodes, to: Vec::new(), left: Vec::new() }
    }

    /// Joins two nodes by an edge of this capacity, in both directions.
    pub fn join(&mut self, a: usize, b: usize, capacity: u64) {
        self.to.extend([b as u32, a as u32]);
        self.left.extend([capacity, capacity]);
    }

    /// Whether each node is on the side of `source` in the cheapest cut that parts it
    /// from `sink`; of several, the one nearest to `source`.
    #[must_use]
    pub fn cut(mut self, source: usize, sink: usize) -> Vec<bool> {
        let (start, arcs) = self.arcs();
        loop {
            let level = self.levels(source, &start, &arcs);
            if level[sink] == u32::MAX {
                return level.into_iter().map(|level| level != u32::MAX).collect();
            }
            self.block(source, sink, &level, &start, &arcs);
        }
    }

    /// The arcs that leave each node, node after node.
    fn arcs(&self) -> (Vec<u32>, Vec<u32>) {
        let from = |arc: usize| self.to[arc ^ 1] as usize;
        let mut start = vec![0_u32; self.nodes + 1];
        (0..self.to.len()).for_each(|arc| start[from(arc) + 1] += 1);
        for node in 0..self.nodes {
            start[node + 1] += start[node];
        }
        let mut next = start.clone();
        let mut arcs = vec![0; self.to.len()];
        for arc in 0..self.to.len() {
            let place = &mut next[from(arc)];
            arcs[*place as usize] = arc as u32;
            *place += 1;
        }
        (start, arcs)
    }

    /// Steps from the source to each node over arcs that can take more.
    fn levels(&self, source: usize, start: &[u32], arcs: &[u32]) -> Vec<u32> {
        let mut level = vec![u32::MAX; self.nodes];
        let mut queue = vec![source as u32];
        level[source] = 0;
        let mut head = 0;
        while let Some(&node) = queue.get(head) {
            head += 1;
            let node = node as usize;
            for &arc in &arcs[start[node] as usize..start[node + 1] as usize] {
                let to = self.to[arc as usize];
                if self.left[arc as usize] > 0 && level[to as usize] == u32::MAX {
                    level[to as usize] = level[node] + 1;
                    queue.push(to);
                }
            }
        }
        level
    }

    /// Fills every shortest path.
    fn block(&mut self, source: usize, sink: usize, level: &[u32], start: &[u32], arcs: &[u32]) {
        let mut next: Vec<u32> = start[..self.nodes].to_vec();
        let mut path: Vec<u32> = Vec::new();
        let mut node = source;
        loop {
            if node == sink {
                let most = path.iter().map(|&arc| self.left[arc as usize]).min().unwrap_or(0);
                for &arc in &path {
                    self.left[arc as usize] -= most;
                    self.left[arc as usize ^ 1] += most;
                }
                // Back to before the first arc that is full.
                let full = path.iter().position(|&arc| self.left[arc as usize] == 0).unwrap_or(0);
                node = self.to[path[full] as usize ^ 1] as usize;
                path.truncate(full);
                continue;
            }
            let onward = (next[node]..start[node + 1]).find(|&k| {
                let arc = arcs[k as usize] as usize;
                self.left[arc] > 0 && level[self.to[arc] as usize] == level[node] + 1
            });
            match onward {
                Some(k) => {
                    next[node] = k;
                    path.push(arcs[k as usize]);
                    node = self.to[arcs[k as usize] as usize] as usize;
                }
                None => {
                    // A dead end: nothing leads here in this round any more.
                    next[node] = start[node + 1];
                    let Some(arc) = path.pop() else { return };
                    node = self.to[arc as usize ^ 1] as usize;
                    next[node] += 1;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt as _;

    fn cost(edges: &[(usize, usize, u64)], side: &[bool]) -> u64 {
        edges.iter().filter(|e| side[e.0] != side[e.1]).map(|e| e.2).sum()
    }

    #[test]
    fn no_other_cut_is_cheaper() {
        for case in 0..200 {
            let mut rng = crate::base::seed::rng(case, "min-cut", 0);
            let nodes = 9;
            let edges: Vec<(usize, usize, u64)> = (0..18)
                .map(|_| {
                    let [a, b] = [0; 2].map(|_| rng.random_range(0..nodes));
                    (a, b, rng.random_range(1..20))
                })
                .filter(|e| e.0 != e.1)
                .collect();
            let mut network = Network::new(nodes);
            edges.iter().for_each(|&(a, b, capacity)| network.join(a, b, capacity));
            let found = network.cut(0, 1);
            assert!(found[0] && !found[1]);
            let of = |bits: usize| (0..nodes).map(|n| bits >> n & 1 == 1).collect::<Vec<_>>();
            let parting = (0..1 << nodes).filter(|bits| bits & 3 == 1);
            let least = parting.map(|bits| cost(&edges, &of(bits))).min().unwrap();
            assert_eq!(cost(&edges, &found), least, "case {case}");
        }
    }
}
