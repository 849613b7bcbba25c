function lines = read_lines(file)
%READ_LINES  The lines of a text file, L-by-1 cell of character rows, their ends taken off.

lines = regexp(read_text(file), '\r?\n', 'split')';
if isempty(lines{end})
    lines(end) = [];   % what follows the end of the last line is none
end
end
