function run_batch(file)
%RUN_BATCH  Answer each line of a file of commands with a line of JSON.
%   RUN_BATCH(FILE) prints as many lines as FILE has. Names of files in it are relative
%   to its folder. A command that fails prints {"error": ...}, and the rest
%   goes on.
%
%   See also RUN_COMMAND.

lines = read_lines(file);
folder = fileparts(file);
for k = 1:numel(lines)
    try
        answer = run_command(strsplit(strtrim(lines{k})), folder);
    catch mistake
        answer = struct('error', mistake.message);
    end
    fprintf('%s\n', to_json(answer));
end
end
