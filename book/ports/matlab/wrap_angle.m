function theta = wrap_angle(theta)
%WRAP_ANGLE  Wrap angles into (-pi, pi].
%   THETA = WRAP_ANGLE(THETA) takes angles of any size [rad]. An angle that lies in the
%   interval already comes back bit for bit; -pi becomes pi.

outside = theta <= -pi | theta > pi;
theta(outside) = pi - mod(pi - theta(outside), 2 * pi);
theta(theta == -pi) = pi;   % mod rounds up to 2*pi just above pi
end
