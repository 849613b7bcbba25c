function [parameters, T_initial] = read_parameters(file)
%READ_PARAMETERS  The matcher's parameters and the initial guess from a JSON file.
%   [PARAMETERS, T_INITIAL] = READ_PARAMETERS(FILE) reads one flat object of numbers. Its
%   keys are those of ICP_PARAMETERS, and initial_x, initial_y [m] and initial_theta [rad],
%   which are 0 by default and make up T_INITIAL, 3-by-3. A null turns the gate or Huber's
%   delta off. Anything else raises an error whose message begins with FILE.

text = read_text(file);
try
    members = jsondecode(text);
catch reason
    error('icp2d:file', '%s: is no JSON: %s', file, reason.message);
end
if ~isstruct(members) || ~isscalar(members) || any(text == '[') || any(text == 0)
    error('icp2d:file', '%s: must hold one flat object of numbers', file);
end

guess = struct('initial_x', 0, 'initial_y', 0, 'initial_theta', 0);
settings = {};
for key = written_keys(text, file)
    name = key{1};
    value = number_of(members.(name), name, file);
    if isfield(guess, name)
        guess.(name) = value;
    else
        settings = [settings, {name, value}]; %#ok<AGROW>
    end
end

try
    parameters = icp_parameters(settings{:});
catch reason
    error(reason.identifier, '%s: %s', file, reason.message);
end
T_initial = pose_to_transform([guess.initial_x, guess.initial_y, guess.initial_theta]);
end

function names = written_keys(text, file)
% The keys as the file spells them: JSONDECODE turns 'huber-delta' into a valid name.
tokens = regexp(text, '"([^"]*)"\s*:', 'tokens');
names = cellfun(@(token) token{1}, tokens, 'UniformOutput', false);
known = [fieldnames(icp_parameters()); {'initial_x'; 'initial_y'; 'initial_theta'}];
unknown = setdiff(names, known);
if ~isempty(unknown)
    error('icp2d:parameter', '%s: unknown key "%s"; known are %s', ...
        file, unknown{1}, strjoin(known', ', '));
end
if numel(unique(names)) < numel(names)
    error('icp2d:parameter', '%s: a key occurs twice', file);
end
end

function value = number_of(value, name, file)
% A finite number as it is; null, which JSONDECODE makes [], as the Inf that it stands for.
if isa(value, 'double') && isempty(value)
    if ~any(strcmp(name, {'max_correspondence_distance', 'huber_delta'}))
        error('icp2d:parameter', '%s: `%s` must be a number, got null', file, name);
    end
    value = Inf;
elseif ~isa(value, 'double') || ~isscalar(value)
    error('icp2d:parameter', '%s: `%s` must be a number, got %s', ...
        file, name, jsonencode(value));
elseif ~isfinite(value)   % some readers of JSON let NaN and Infinity pass
    error('icp2d:parameter', '%s: `%s` must be finite, got %g', file, name, value);
end
end
