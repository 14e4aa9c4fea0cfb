//! The pattern of a block matrix: which nodes are coupled, how many scalars each owns, where its blocks lie.

/// A symmetric pattern of dense blocks. Node i owns `sizes[i]` scalar rows; row i of the pattern names its
/// neighbours ascending, itself among them; block (i, j) is stored row by row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Graph {
    /// Scalar rows per node.
    pub sizes: Vec<u32>,
    /// Start of each node's neighbours; one entry more than nodes.
    pub starts: Vec<u32>,
    /// Neighbours, ascending within a node.
    pub neighbours: Vec<u32>,
    /// Where block k of the pattern starts in the array of values.
    pub offsets: Vec<u32>,
    /// First scalar row of each node; one entry more than nodes.
    pub first: Vec<u32>,
}

impl Graph {
    /// A pattern from sizes and neighbour lists in compressed form (ascending, symmetric, diagonal included).
    pub fn new(sizes: Vec<u32>, starts: Vec<u32>, neighbours: Vec<u32>) -> Self {
        let mut first = Vec::with_capacity(sizes.len() + 1);
        let mut scalars = 0;
        for &size in &sizes {
            first.push(scalars);
            scalars += size;
        }
        first.push(scalars);
        let mut offsets = Vec::with_capacity(neighbours.len());
        let mut offset = 0;
        for i in 0..sizes.len() {
            for &j in &neighbours[starts[i] as usize..starts[i + 1] as usize] {
                offsets.push(offset);
                offset += sizes[i] * sizes[j as usize];
            }
        }
        offsets.push(offset);
        Graph { sizes, starts, neighbours, offsets, first }
    }
    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.sizes.len()
    }
    /// Number of scalar rows.
    pub fn scalars(&self) -> usize {
        self.first.last().map_or(0, |&n| n as usize)
    }
    /// Length of the array of values.
    pub fn values(&self) -> usize {
        self.offsets.last().map_or(0, |&n| n as usize)
    }
    /// The positions of node i's blocks in the pattern.
    pub fn row(&self, i: usize) -> std::ops::Range<usize> {
        self.starts[i] as usize..self.starts[i + 1] as usize
    }
    /// The position of block (i, j) in the pattern, if it is stored.
    pub fn position(&self, i: usize, j: usize) -> Option<usize> {
        let row = self.row(i);
        self.neighbours[row.clone()].binary_search(&(j as u32)).ok().map(|k| row.start + k)
    }
}
