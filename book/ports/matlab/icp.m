function result = icp(source, target, T_initial, parameters)
%ICP  Estimate the transform that maps the newer scan onto the older one.
%   RESULT = ICP(SOURCE, TARGET, T_INITIAL, PARAMETERS) matches SOURCE, N-by-2, against
%   TARGET, M-by-2 [m], from the initial guess T_INITIAL, 3-by-3. PARAMETERS comes from
%   ICP_PARAMETERS. RESULT is a struct:
%
%   T_target_source   the estimate, 3-by-3, with q = R*p + t; NaN where the run failed
%   termination       'converged_pose', 'converged_cost' or 'budget_spent'; and where it
%                     failed 'too_few_correspondences' or 'degenerate'
%   iterations        steps taken
%   inlier_count, fitness, inlier_rmse, cost   of the last association; see ASSOCIATE
%
%   Example:
%       target = rand(100, 2) * 5;
%       T_target_source = pose_to_transform([0.05, -0.02, 0.01]);
%       source = transform_points(inv(T_target_source), target);
%       result = icp(source, target, eye(3), icp_parameters());
%       transform_to_pose(result.T_target_source)   % 0.05  -0.02  0.01

check_points(source, 'source');
check_points(target, 'target');

T = T_initial;
iterations = 0;
pairs = associate(source, target, T, parameters);
termination = check_pairs(pairs);
while isempty(termination)
    [dT, degenerate] = align_weighted(pairs.source, pairs.target, pairs.weight);   % minimise
    if ~isempty(degenerate)
        termination = 'degenerate';
        break
    end
    T_before = T;
    cost_before = pairs.cost;
    T = dT * T_before;   % the update composes on the left
    iterations = iterations + 1;
    pairs = associate(source, target, T, parameters);
    dcost = pairs.cost - cost_before;
    termination = check_convergence(T, T_before, pairs, dcost, iterations, parameters);
end

if any(strcmp(termination, {'too_few_correspondences', 'degenerate'}))
    T = nan(3);   % no guess passes for an estimate
end
result = struct('T_target_source', T, 'termination', termination, ...
    'iterations', iterations, 'inlier_count', pairs.inlier_count, ...
    'fitness', pairs.fitness, 'inlier_rmse', pairs.inlier_rmse, 'cost', pairs.cost);
end

function termination = check_pairs(pairs)
% Why no step can come from the pairs; empty where one can.
termination = '';
if pairs.inlier_count < 3
    termination = 'too_few_correspondences';
end
end

function termination = check_convergence(T, T_before, pairs, dcost, iterations, parameters)
% Why to stop after a step; empty to go on. The two tests of the pose hold together: a scan
% that turns about its own centre does not travel. They come before the count of pairs: the
% pose was estimated from enough of them.
travelled = norm(T(1:2, 3) - T_before(1:2, 3));
dR = T_before(1:2, 1:2)' * T(1:2, 1:2);
turned = abs(atan2(dR(2, 1), dR(1, 1)));
if travelled < parameters.translation_tolerance && turned < parameters.rotation_tolerance
    termination = 'converged_pose';
elseif ~isempty(check_pairs(pairs))
    termination = check_pairs(pairs);
elseif abs(dcost) < parameters.cost_tolerance   % a tolerance of 0 turns the test off
    termination = 'converged_cost';
elseif iterations >= parameters.max_iterations
    termination = 'budget_spent';
else
    termination = '';
end
end
