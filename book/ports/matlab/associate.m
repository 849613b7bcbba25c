function pairs = associate(source, target, T_target_source, parameters)
%ASSOCIATE  Match, reject and weight at a pose: the pairs of one iteration.
%   PAIRS = ASSOCIATE(SOURCE, TARGET, T_TARGET_SOURCE, PARAMETERS) moves SOURCE, N-by-2 [m],
%   into the frame of TARGET, M-by-2 [m], and pairs each point with the nearest one there.
%   PARAMETERS comes from ICP_PARAMETERS. PAIRS is a struct:
%
%   source, target   the K kept pairs in the target's frame, K-by-2 each [m]
%   weight           Huber's weight of each, K-by-1
%   inlier_count     K, the pairs that pass both gate and overlap
%   fitness          K/N
%   inlier_rmse      root mean square distance of the kept pairs [m]; NaN where K = 0
%   cost             the truncated Huber cost over all N source points [m^2]      (4.1)

moved = transform_points(T_target_source, source);
[index, distance] = nearest_neighbors(moved, target);

gate = parameters.max_correspondence_distance;
delta = parameters.huber_delta;
[within_gate, within_overlap] = reject_pairs(distance, gate, parameters.overlap_ratio);
kept = within_gate & within_overlap;

pairs.source = moved(kept, :);
pairs.target = target(index(kept), :);
pairs.weight = huber_weights(distance(kept), delta);
pairs.inlier_count = nnz(kept);
pairs.fitness = pairs.inlier_count / numel(kept);
pairs.inlier_rmse = sqrt(sum(distance(kept).^2) / pairs.inlier_count);
charged = min(distance(within_overlap), gate);   % beyond the gate as if on it
pairs.cost = sum(huber_loss(charged, delta)) / numel(kept);
end
