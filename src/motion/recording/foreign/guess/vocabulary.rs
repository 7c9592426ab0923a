//! Words of many loggers, lower case, with blanks between them.

/// Words for legs, in romc's order.
pub(super) const LEGS: [&str; 4] = [
    "fr rf vr frontright rightfront foreright rightfore",
    "fl lf vl frontleft leftfront foreleft leftfore",
    "rr hr rh br rb rearright hindright backright rightrear righthind",
    "rl hl lh bl lb rearleft hindleft backleft leftrear lefthind",
];
/// Words for joints, in romc's order; a bare `hip` is the first, unless `y`, `pitch` or `flexion` is beside it or
/// another joint of the leg is.
pub(super) const JOINTS: [&str; 3] = [
    "hx haa abad abduction hipx hipaa",
    "hy hfe thigh upper flexion hipy hipfe",
    "kn kfe calf knee lower shank",
];
pub(super) const TORQUE: &str = "torque torques tau effort efforts trq moment tauest ctrl";
pub(super) const ACCELERATION: &str = "acceleration acc accel ddq qdd ddot accelerometer";
pub(super) const VELOCITY: &str = "velocity vel dq qd qdot dot speed rate rates twist v dp dx";
pub(super) const ANGULAR_VELOCITY: &str = "gyro gyroscope omega w angvel";
pub(super) const ANGULAR: &str = "angular rpy euler attitude orientation ang rot rotation";
pub(super) const QUATERNION: &str = "quat quaternion orientation attitude rotation rot q";
pub(super) const PLACE: &str = "position pos p com base body trunk torso pose odom";
pub(super) const FEET: &str = "foot feet contact contacts grf touch stance toe fz";
pub(super) const JOINT_ARRAYS: &str = "motor motors joint joints q dq ddq qd qdd qdot tau torque torques effort efforts position \
     velocity dof ctrl actuator angle angles theta";
/// Words of values that a controller asked for rather than measured.
pub(super) const WANTED: &str = "des desired ref reference cmd command target setpoint goal raw lost temperature mode \
     covariance ff kp kd";
pub(super) const TIME: &str = "time timestamp stamp t sec secs seconds clock datetime date";
