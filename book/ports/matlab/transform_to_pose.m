function pose = transform_to_pose(T)
%TRANSFORM_TO_POSE  Pose of a rigid transform.
%   POSE = TRANSFORM_TO_POSE(T_A_B) undoes POSE_TO_TRANSFORM: [x, y, theta], 1-by-3,
%   [m, m, rad], with theta in (-pi, pi]. A transform of NaN gives a pose of NaN.

pose = [T(1, 3), T(2, 3), wrap_angle(atan2(T(2, 1), T(1, 1)))];
end
