//! Imports as a directed graph, and its cycles.

use std::collections::{BTreeMap, BTreeSet};

use super::imports::Source;

/// Names and, of each, what it imports.
pub struct Graph {
    /// Files or folders.
    pub names: Vec<String>,
    /// The indices that each imports.
    pub edges: Vec<BTreeSet<usize>>,
}

impl Graph {
    /// File to file.
    pub fn of_files(sources: &[Source]) -> Self {
        Self::new(sources, |source| &source.path)
    }

    /// Folder to folder.
    pub fn of_folders(sources: &[Source]) -> Self {
        Self::new(sources, Source::folder)
    }

    fn new<'s>(sources: &'s [Source], name: impl Fn(&'s Source) -> &'s str) -> Self {
        let names: BTreeSet<&str> = sources.iter().map(&name).collect();
        let index: BTreeMap<&str, usize> = names.iter().enumerate().map(|(i, name)| (*name, i)).collect();
        let mut edges = vec![BTreeSet::new(); names.len()];
        for source in sources {
            let from = index[name(source)];
            edges[from].extend(source.imports.iter().map(|&to| index[name(&sources[to])]).filter(|to| *to != from));
        }
        Self { names: names.into_iter().map(str::to_owned).collect(), edges }
    }

    fn reachable(&self, from: usize) -> BTreeSet<usize> {
        let mut seen = BTreeSet::new();
        let mut open = vec![from];
        while let Some(at) = open.pop() {
            open.extend(self.edges[at].iter().copied().filter(|to| seen.insert(*to)));
        }
        seen
    }
}

/// The strongly connected components: sets of nodes each of which reaches every other.
pub fn components(graph: &Graph) -> Vec<Vec<usize>> {
    let reach: Vec<BTreeSet<usize>> = (0..graph.names.len()).map(|i| graph.reachable(i)).collect();
    let mut done = BTreeSet::new();
    let mut found = Vec::new();
    for i in 0..graph.names.len() {
        if done.insert(i) {
            let others = (i + 1..graph.names.len()).filter(|&j| reach[i].contains(&j) && reach[j].contains(&i));
            let members: Vec<usize> = std::iter::once(i).chain(others).collect();
            done.extend(members.iter().copied());
            found.push(members);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cycle_is_found_and_what_hangs_on_it_is_not_of_it() {
        let edges = [&[1][..], &[2], &[0, 3], &[]];
        let graph = Graph {
            names: ["a", "b", "c", "d"].map(str::to_owned).to_vec(),
            edges: edges.map(|to| to.iter().copied().collect()).to_vec(),
        };
        assert_eq!(components(&graph), [vec![0, 1, 2], vec![3]]);
    }
}
