function [source, target, T_target_source] = lesson_scene(seed)
%LESSON_SCENE  The lesson's kind of scene: two noisy scans and the truth between them.
%   [SOURCE, TARGET, T_TARGET_SOURCE] = LESSON_SCENE(SEED) draws a world of two walls and
%   scattered points, and scans it from the origin (TARGET, M-by-2) and from the pose
%   T_TARGET_SOURCE, 3-by-3, of 0.35 m, 0.10 m and 6 degrees (SOURCE, N-by-2) [m]. SEED is a
%   whole number >= 0; the stream of random numbers of the caller goes on undisturbed.

before = rng();
restore = onCleanup(@() rng(before));
rng(seed, 'twister');

world = [8 * rand(150, 1), zeros(150, 1); ...
         zeros(150, 1), 6 * rand(150, 1); ...
         8 * rand(300, 1), 6 * rand(300, 1)];
T_target_source = pose_to_transform([0.35, 0.10, 6 * pi / 180]);
target = scan(world, eye(3));
source = scan(world, T_target_source);
end

function points = scan(world, T_world_scanner)
% What a scanner sees within 10 m and 135 degrees to either side, with noise and clutter.
seen = transform_points(inv(T_world_scanner), world);
distance = sqrt(sum(seen.^2, 2));
bearing = atan2(seen(:, 2), seen(:, 1));
seen = seen(distance <= 10 & abs(bearing) <= 135 * pi / 180, :);
noise = 0.01 * randn(size(seen));
clutter = 4 * rand(max(5, floor(size(seen, 1) / 40)), 2) - 2;
points = [seen + noise; clutter];
end
