function [T_target_source, degenerate] = align_weighted(p, q, w)
%ALIGN_WEIGHTED  Closed-form rigid alignment of weighted pairs of points.
%   T_TARGET_SOURCE = ALIGN_WEIGHTED(P, Q, W) minimises
%
%       J(R, t) = sum of w * norm(R*p + t - q)^2                              (2.1)
%
%   over all rotations R and translations t. Row i of P and of Q, both N-by-2 [m], are a
%   pair with the weight W(i) >= 0, N-by-1; P belongs to the source, Q to the target. Only
%   the ratios of the weights matter. The result is 3-by-3.
%
%   Where more than one rotation fits equally well, an error icp2d:degenerate is raised.
%
%   [T_TARGET_SOURCE, DEGENERATE] = ALIGN_WEIGHTED(P, Q, W) raises none then, as
%   [R, FLAG] = CHOL(A) does: DEGENERATE says why, T_TARGET_SOURCE is NaN. It is empty where
%   the transform is determined.
%
%   Example:
%       T = align_weighted([0 0; 1 0], [2 3; 2 4], [1; 1])   % [0 -1 2; 1 0 3; 0 0 1]

check_pairs(p, q, w);
T_target_source = nan(3);
degenerate = '';

kept = w > 0;             % a pair without weight says nothing, wherever it lies
p = p(kept, :);
q = q(kept, :);
w = w(kept);
total = sum(w);
p_mean = w' * p / total;
q_mean = w' * q / total;
x = p - p_mean;                                                   % (2.2)
y = q - q_mean;
source_spread = sqrt(w' * sum(x.^2, 2) / total);
target_spread = sqrt(w' * sum(y.^2, 2) / total);
a = w' * sum(x .* y, 2);                                          % (2.5)
b = w' * (x(:, 1) .* y(:, 2) - x(:, 2) .* y(:, 1));               % (2.6)

if ~any(kept)
    degenerate = 'all weights are zero';
elseif source_spread <= resolution(p, x)
    degenerate = 'the weighted source points coincide';
elseif target_spread <= resolution(q, y)
    degenerate = 'the weighted target points coincide';
elseif hypot(a, b) <= 1e-10 * total * source_spread * target_spread
    degenerate = 'every rotation fits equally well';
else
    theta = atan2(b, a);                                          % (2.7)
    t = q_mean' - rotation_matrix(theta) * p_mean';               % (2.3)
    T_target_source = pose_to_transform([t', theta]);
end

if nargout < 2 && ~isempty(degenerate)
    error('icp2d:degenerate', 'degenerate: %s', degenerate);
end
end

function smallest = resolution(points, centered)
% The spread [m] up to which points coincide: rounding of their own size, or of their extent.
smallest = max(64 * eps * max(abs(points(:))), 1e-10 * max(abs(centered(:))));
end

function check_pairs(p, q, w)
check_points(p, 'p');
check_points(q, 'q');
if size(p, 1) ~= size(q, 1) || ~isequal(size(w), [size(p, 1), 1])
    error('icp2d:points', 'p, q and w must have as many rows, got %d, %d and %d', ...
        size(p, 1), size(q, 1), numel(w));
end
wrong = find(~(isfinite(w) & w >= 0), 1);
if ~isempty(wrong)
    error('icp2d:points', 'w must be finite and not negative, got %g in row %d', ...
        w(wrong), wrong);
end
end
