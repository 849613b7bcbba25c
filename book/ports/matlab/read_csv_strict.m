function rows = read_csv_strict(file, columns, last)
%READ_CSV_STRICT  Rows of finite numbers, with nothing guessed.
%   ROWS = READ_CSV_STRICT(FILE, COLUMNS) reads COLUMNS comma-separated numbers a line, R lines
%   without a header: R-by-COLUMNS. A line with too few or too many fields, and a field that
%   is no finite number, raise icp2d:file with a message that begins with FILE:LINE, as does
%   a file without rows.
%
%   ROWS = READ_CSV_STRICT(FILE, COLUMNS, LAST) lets a line leave out its last field, for
%   which the word LAST then stands.
%
%   READMATRIX and CSVREAD fill gaps with NaN or 0, which a matcher must not see.

lines = read_lines(file);
if isempty(lines)
    error('icp2d:file', '%s:1: holds no rows', file);
end

fields = regexp(lines, ',', 'split');
expected = sprintf('%d', columns);
if nargin > 2
    short = cellfun(@numel, fields) == columns - 1;
    fields(short) = cellfun(@(line) [line, {last}], fields(short), 'UniformOutput', false);
    expected = sprintf('%d or %d', columns - 1, columns);
end
counts = cellfun(@numel, fields);
wrong = find(counts ~= columns, 1);
if ~isempty(wrong)
    error('icp2d:file', '%s:%d: expected %s fields, got %d: ''%s''', ...
        file, wrong, expected, counts(wrong), lines{wrong});
end

fields = vertcat(fields{:});
rows = parse_numbers(fields);
wrong = find(any(isnan(rows), 2), 1);
if ~isempty(wrong)
    word = fields{wrong, find(isnan(rows(wrong, :)), 1)};
    error('icp2d:file', '%s:%d: ''%s'' is not a finite number', file, wrong, word);
end
end
