function weight = huber_weights(residual, delta)
%HUBER_WEIGHTS  Huber's weights: 1 up to delta, delta/r beyond.
%   WEIGHT = HUBER_WEIGHTS(RESIDUAL, DELTA) takes the magnitudes r of residuals, N-by-1 [m],
%   not their squares, and gives weights of the same size in (0, 1]. A DELTA of Inf weighs
%   all alike.
%
%   See also HUBER_LOSS.

weight = min(1, delta ./ residual);   % r = 0 gives Inf, and so 1
end
