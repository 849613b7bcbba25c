function [within_gate, within_overlap] = reject_pairs(distance, gate, overlap_ratio)
%REJECT_PAIRS  Which pairs pass the gate, and which the overlap.
%   [WITHIN_GATE, WITHIN_OVERLAP] = REJECT_PAIRS(DISTANCE, GATE, OVERLAP_RATIO) judges the
%   distances of all N source points, N-by-1 [m]:
%
%   WITHIN_GATE      distance <= GATE [m]; Inf turns the gate off.
%   WITHIN_OVERLAP   among the floor(OVERLAP_RATIO * N) closest, at least 3 where there are
%                    as many; of equal distances the first.
%
%   Both are N-by-1 logical. The overlap counts all source points, gated or not, so its
%   ratio keeps its meaning: the share of the source that has a partner.

within_gate = distance <= gate;

count = numel(distance);
kept = min(count, max(3, floor(overlap_ratio * count)));
[~, order] = sort(distance);   % stable: equal distances stay in their order
within_overlap = false(count, 1);
within_overlap(order(1:kept)) = true;
end
