//! Programs: what is computed, in which order.
