function parameters = icp_parameters(varargin)
%ICP_PARAMETERS  Everything that ICP can be told, checked.
%   PARAMETERS = ICP_PARAMETERS() is a struct of the defaults.
%   PARAMETERS = ICP_PARAMETERS(NAME, VALUE, ...) sets some of them:
%
%   max_correspondence_distance   0.5     gate, > 0 [m]; Inf turns it off
%   overlap_ratio                 0.85    share of the source that is kept, in (0, 1]
%   huber_delta                   0.2     > 0 [m]; Inf weighs all pairs alike
%   max_iterations                60      budget, a whole number >= 1
%   translation_tolerance         1e-6    converged when a step stays below both
%   rotation_tolerance            1e-6      of these, >= 0 [m] and [rad],
%   cost_tolerance                1e-12   or changes the cost by less, >= 0 [m^2]; 0 is off
%
%   A value out of its range raises icp2d:parameter with a message that carries it.

parameters = struct( ...
    'max_correspondence_distance', 0.5, ...
    'overlap_ratio', 0.85, ...
    'huber_delta', 0.2, ...
    'max_iterations', 60, ...
    'translation_tolerance', 1e-6, ...
    'rotation_tolerance', 1e-6, ...
    'cost_tolerance', 1e-12);

if mod(nargin, 2) ~= 0
    error('icp2d:parameter', 'parameters come as pairs of name and value, got %d', nargin);
end
for k = 1:2:nargin
    name = varargin{k};
    if ~ischar(name) || ~isfield(parameters, name)
        error('icp2d:parameter', 'unknown parameter `%s`; known are %s', ...
            char(name), strjoin(fieldnames(parameters)', ', '));
    end
    parameters.(name) = varargin{k + 1};
end

positive = @(x) x > 0;
not_negative = @(x) x >= 0;
require(parameters, 'max_correspondence_distance', positive, 'in (0, Inf] m');
require(parameters, 'overlap_ratio', @(x) x > 0 && x <= 1, 'in (0, 1]');
require(parameters, 'huber_delta', positive, 'in (0, Inf] m');
require(parameters, 'max_iterations', @(x) x >= 1 && x == floor(x) && isfinite(x), ...
    'a whole number of at least 1');
require(parameters, 'translation_tolerance', not_negative, 'in [0, Inf] m');
require(parameters, 'rotation_tolerance', not_negative, 'in [0, Inf] rad');
require(parameters, 'cost_tolerance', not_negative, 'in [0, Inf] m^2');
end

function require(parameters, name, inside, range)
value = parameters.(name);
if ~isa(value, 'double') || ~isreal(value) || ~isscalar(value)
    error('icp2d:parameter', '`%s` must be %s, got %s', name, range, shown(value));
elseif ~inside(value)
    error('icp2d:parameter', '`%s` must be %s, got %.15g', name, range, value);
end
end

function text = shown(value)
if ischar(value)
    text = ['''', value, ''''];
elseif isnumeric(value) || islogical(value)
    text = mat2str(value);
else
    text = ['a ', class(value)];
end
end
