//! Nodes of expressions, and maps of expressions.

use super::*;

/// A canonical expression of one [`ExprPool`](super::ExprPool): structurally equal exactly if the ids are equal.
/// Children have smaller ids than parents; sort by [`ExprPool::compare`](super::ExprPool::compare), not by ids.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ExprId(pub(super) u32);

impl ExprId {
    /// The exact `0`, present in every pool.
    pub const ZERO: ExprId = ExprId(0);
    /// The exact `1`, present in every pool.
    pub const ONE: ExprId = ExprId(1);

    pub(crate) fn index(self) -> usize {
        self.0 as usize
    }
}

/// A named variable of one pool.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SymbolId(pub(super) u32);

impl SymbolId {
    /// Position among the pool's symbols, in order of first mention.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// One level of a canonical expression; see [`ExprPool`](super::ExprPool) for the invariants.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Node {
    Number(Number),
    Symbol(SymbolId),
    /// Two or more terms `coefficient * rest`, sorted, with distinct rests; never a sum itself.
    Sum(Arc<[ExprId]>),
    /// Two or more factors, the numeric one first; never a product itself.
    Product(Arc<[ExprId]>),
    /// Base and exponent; the exponent is neither 0 nor 1.
    Power(ExprId, ExprId),
    Apply(Function, ExprId),
}

impl Node {
    pub(super) fn operands(&self) -> impl Iterator<Item = ExprId> + '_ {
        let (pair, list): ([Option<ExprId>; 2], &[ExprId]) = match self {
            Node::Number(_) | Node::Symbol(_) => ([None, None], &[]),
            Node::Sum(operands) | Node::Product(operands) => ([None, None], operands),
            Node::Power(base, exponent) => ([Some(*base), Some(*exponent)], &[]),
            Node::Apply(_, argument) => ([Some(*argument), None], &[]),
        };
        pair.into_iter().flatten().chain(list.iter().copied())
    }
}

pub(super) type IdMap<V> = HashMap<ExprId, V, BuildIdHasher>;
pub(super) type IdSet = HashSet<ExprId, BuildIdHasher>;

/// Keys are ids and numbers of the pool's own: resistance to chosen collisions is not needed, only speed.
pub(super) type BuildIdHasher = rustc_hash::FxBuildHasher;
