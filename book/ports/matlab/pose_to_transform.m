function T = pose_to_transform(pose)
%POSE_TO_TRANSFORM  Rigid transform of a pose.
%   T_A_B = POSE_TO_TRANSFORM(POSE) builds the 3-by-3 matrix [R(theta), t; 0 0 1] from the
%   pose [x, y, theta] of frame b in frame a, 1-by-3, [m, m, rad].
%
%   See also TRANSFORM_TO_POSE, TRANSFORM_POINTS.

T = [rotation_matrix(pose(3)), [pose(1); pose(2)]; 0, 0, 1];
end
