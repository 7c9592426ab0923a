//! Loops compiled twice, once with the vectors of newer processors; which of the two runs is decided at run time.
//!
//! The bits are the same with both: the compiler contracts no product with a sum.

/// A loop over numbers; `run` must be `inline(always)` to get the vectors of where it is called.
pub trait Loop {
    /// Runs it.
    fn run(self);
}

/// Runs a loop with the widest vectors that the processor has.
pub fn run(work: impl Loop) {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2,fma")]
        fn with_avx2(work: impl Loop) {
            work.run();
        }
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            // SAFETY: the processor has what this is compiled for.
            return unsafe { with_avx2(work) };
        }
    }
    work.run();
}
