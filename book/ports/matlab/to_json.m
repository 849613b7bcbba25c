function text = to_json(value)
%TO_JSON  JSON of a struct of numbers and words, at full precision.
%   TEXT = TO_JSON(VALUE) writes a scalar struct as an object, a character row as a string, a
%   scalar as a number of 17 significant digits, which reads back bit for bit (JSONENCODE
%   keeps 15 or 16), and a row or a cell array as an array. What is not finite becomes null.

if isstruct(value)
    names = fieldnames(value)';
    members = cellfun(@(name) ['"', name, '": ', to_json(value.(name))], names, ...
        'UniformOutput', false);
    text = ['{', strjoin(members, ', '), '}'];
elseif ischar(value)
    text = quoted(value);
elseif iscell(value)
    items = cellfun(@to_json, value(:)', 'UniformOutput', false);
    text = ['[', strjoin(items, ', '), ']'];
elseif isscalar(value) && isfinite(value)
    text = sprintf('%.17g', value);
elseif isscalar(value)
    text = 'null';
else
    text = to_json(num2cell(value));
end
end

function text = quoted(text)
text = strrep(strrep(text, '\', '\\'), '"', '\"');
text(text < ' ') = ' ';   % JSON forbids control characters
text = ['"', text, '"'];
end
