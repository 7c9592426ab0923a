//! Joints, legs and limits of the quadrupeds that romc knows.
