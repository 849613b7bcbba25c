function loss = huber_loss(residual, delta)
%HUBER_LOSS  Huber's loss: r^2 up to delta, 2*delta*r - delta^2 beyond.
%   LOSS = HUBER_LOSS(RESIDUAL, DELTA) takes the magnitudes r of residuals [m] and gives
%   losses [m^2] of the same size. A DELTA of Inf leaves the square.
%
%   See also HUBER_WEIGHTS.

capped = min(residual, delta);
loss = capped .* (2 * residual - capped);
end
