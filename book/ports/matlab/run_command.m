function answer = run_command(words, folder)
%RUN_COMMAND  The answer to one command: a struct, to be written as JSON.
%   ANSWER = RUN_COMMAND(WORDS, FOLDER) takes a row of words, a cell array of one of
%
%   {'match', TARGET, SOURCE, PARAMETERS}     the ICP loop on two scans
%   {'align', PAIRS}                          the closed-form alignment of pairs
%   {'integrate', INCREMENTS, X, Y, THETA}    poses from a start pose and increments
%   {'demo', SEED}                            a simulated pair of scans
%
%   Names of files are relative to FOLDER, '' being the current one; numbers are words as
%   they were typed. Bad input raises icp2d:usage, icp2d:file or icp2d:parameter. Degenerate
%   pairs are no bad input: their answer has the one field error.
%
%   See also ICP2D, RUN_BATCH.

command = words{1};
rest = words(2:end);
switch command
    case 'match'
        expect(rest, {'TARGET.csv', 'SOURCE.csv', 'PARAMETERS.json'}, command);
        answer = match(located(rest{1}, folder), located(rest{2}, folder), ...
            located(rest{3}, folder));
    case 'align'
        expect(rest, {'PAIRS.csv'}, command);
        answer = align(located(rest{1}, folder));
    case 'integrate'
        expect(rest, {'INCREMENTS.csv', 'X', 'Y', 'THETA'}, command);
        answer = integrate(located(rest{1}, folder), numbers(rest(2:4)));
    case 'demo'
        expect(rest, {'SEED'}, command);
        answer = demo(whole_number(rest{1}));
    case 'batch'
        error('icp2d:usage', 'a batch cannot hold a batch');
    otherwise
        error('icp2d:usage', ...
            'unknown command ''%s''; known are match, align, integrate, demo, batch', command);
end
end

function answer = match(target_file, source_file, parameters_file)
target = read_csv_strict(target_file, 2);
source = read_csv_strict(source_file, 2);
[parameters, T_initial] = read_parameters(parameters_file);
result = icp(source, target, T_initial, parameters);
pose = transform_to_pose(result.T_target_source);
answer = struct('x', pose(1), 'y', pose(2), 'theta', pose(3), ...
    'termination', result.termination, 'iterations', result.iterations, ...
    'inlier_count', result.inlier_count, 'fitness', result.fitness, ...
    'inlier_rmse', result.inlier_rmse, 'cost', result.cost);
end

function answer = align(pairs_file)
[p, q, w] = read_pairs(pairs_file);
[T_target_source, degenerate] = align_weighted(p, q, w);
if ~isempty(degenerate)
    answer = struct('error', ['degenerate: ', degenerate]);
    return
end
pose = transform_to_pose(T_target_source);
answer = struct('x', pose(1), 'y', pose(2), 'theta', pose(3));
end

function answer = integrate(increments_file, start)
poses = integrate_increments(start, read_csv_strict(increments_file, 3));
answer.poses = num2cell(poses, 2);
end

function answer = demo(seed)
[source, target, T_target_source] = lesson_scene(seed);
T_initial = pose_to_transform([0.20, 0, 3 * pi / 180]);
result = icp(source, target, T_initial, icp_parameters());
answer = struct('truth', transform_to_pose(T_target_source), ...
    'estimate', transform_to_pose(result.T_target_source), ...
    'iterations', result.iterations, 'termination', result.termination, ...
    'inlier_count', result.inlier_count, 'inlier_rmse', result.inlier_rmse);
end

function file = located(name, folder)
file = name;
if isempty(regexp(name, '^([/\\]|[A-Za-z]:)', 'once'))   % not an absolute path
    file = fullfile(folder, name);
end
end

function expect(words, names, command)
if numel(words) ~= numel(names)
    error('icp2d:usage', '%s takes %s, got %d arguments', ...
        command, strjoin(names, ' '), numel(words));
end
end

function seed = whole_number(word)
seed = str2double(word);
if isempty(regexp(word, '^[0-9]+$', 'once')) || seed >= 2^32
    error('icp2d:usage', 'SEED must be a whole number from 0 to 2^32 - 1, got ''%s''', word);
end
end

function values = numbers(words)
values = parse_numbers(words);
wrong = find(isnan(values), 1);
if ~isempty(wrong)
    error('icp2d:usage', '''%s'' is not a finite number', words{wrong});
end
end
