function poses = integrate_increments(start, increments)
%INTEGRATE_INCREMENTS  From increments to poses: where scan matching becomes odometry.
%   POSES = INTEGRATE_INCREMENTS(START, INCREMENTS) begins at the pose START, 1-by-3, and
%   takes K increments, K-by-3, each in the frame of the pose before it: what ICP returns.
%   Rows are [x, y, psi] and [dx, dy, dpsi], [m, m, rad]. POSES is (K+1)-by-3 with START as
%   its first row and headings in (-pi, pi].

poses = [start; zeros(size(increments, 1), 3)];
poses(1, 3) = wrap_angle(start(3));
for k = 1:size(increments, 1)
    R = rotation_matrix(poses(k, 3));
    poses(k + 1, 1:2) = poses(k, 1:2) + increments(k, 1:2) * R';              % (5.4)
    poses(k + 1, 3) = wrap_angle(poses(k, 3) + increments(k, 3));             % (5.3)
end
end
