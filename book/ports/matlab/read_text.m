function text = read_text(file)
%READ_TEXT  The whole text of a file, or an error that names it.
%   TEXT = READ_TEXT(FILE) is a row of characters; where FILE cannot be read, an error
%   icp2d:file says why.

if isfolder(file)
    error('icp2d:file', '%s: is a directory', file);
end
[id, reason] = fopen(file, 'r');
if id < 0
    error('icp2d:file', '%s: cannot be read: %s', file, reason);
end
close_file = onCleanup(@() fclose(id));
text = fread(id, [1, Inf], 'uint8=>char');
end
