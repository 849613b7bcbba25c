function [pose, motion, result] = odometry_step(source, target, pose, motion, parameters)
%ODOMETRY_STEP  One step of scan-matching odometry, its state passed in and out.
%   [POSE, MOTION, RESULT] = ODOMETRY_STEP(SOURCE, TARGET, POSE, MOTION, PARAMETERS) matches
%   the newest scan SOURCE, N-by-2, against the one before, TARGET, M-by-2 [m], and moves the
%   robot on. POSE, 1-by-3, is the robot's in the world, [m, m, rad], MOTION, 1-by-3, its
%   last increment [dx, dy, dpsi]: both go in as they came out of the step before.
%
%   A row that is not finite is a beam without a return and is left out, so scans can keep
%   one size. ICP starts from MOTION. Where it fails, MOTION is held for this step and is
%   zero after it; where a scan has no points, RESULT.termination is 'no_points'.
%
%   RESULT is that of ICP: log its inlier_rmse, inlier_count and termination.
%
%   In Simulink, a MATLAB Function block keeps the state in persistent variables. Scans must
%   have a fixed size, here 720 beams, NaN where a beam has no return. A small budget keeps
%   the step short. The block's whole code:
%
%       function pose_out = scan_odometry(scan)          % scan: 720-by-2 [m]
%       coder.extrinsic('icp_parameters', 'odometry_step');
%       persistent scan_before pose motion
%       if isempty(pose)
%           scan_before = nan(720, 2);                   % no points yet: the pose stands
%           pose = zeros(1, 3);
%           motion = zeros(1, 3);
%       end
%       pose_now = zeros(1, 3);                          % give the results their type
%       motion_now = zeros(1, 3);
%       parameters = icp_parameters('max_iterations', 15);
%       [pose_now, motion_now] = odometry_step(scan, scan_before, pose, motion, parameters);
%       scan_before = scan;
%       pose = pose_now;
%       motion = motion_now;
%       pose_out = pose;
%       end
%
%   The extrinsic calls run in MATLAB itself: right for a simulation, not for generated code.
%
%   See also ICP, INTEGRATE_INCREMENTS.

source = source(all(isfinite(source), 2), :);
target = target(all(isfinite(target), 2), :);
if isempty(source) || isempty(target)
    result = struct('T_target_source', nan(3), 'termination', 'no_points', ...
        'iterations', 0, 'inlier_count', 0, 'fitness', NaN, 'inlier_rmse', NaN, 'cost', NaN);
else
    result = icp(source, target, pose_to_transform(motion), parameters);
end

increment = transform_to_pose(result.T_target_source);
matched = all(isfinite(increment));
if ~matched
    increment = motion;   % nobody saw it, so it is held once
end
poses = integrate_increments(pose, increment);
pose = poses(2, :);
motion = matched * increment;
end
