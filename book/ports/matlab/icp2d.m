function icp2d(command, varargin)
%ICP2D  Point-to-point ICP from the prompt: prints one line of JSON for one command.
%   ICP2D('match', 'TARGET.csv', 'SOURCE.csv', 'PARAMETERS.json')   the ICP loop
%   ICP2D('align', 'PAIRS.csv')                                     closed-form alignment
%   ICP2D('integrate', 'INCREMENTS.csv', 'X', 'Y', 'THETA')         poses from increments
%   ICP2D('demo', 'SEED')                                           simulated scans
%   ICP2D('batch', 'COMMANDS.txt')                                  one command a line
%
%   All arguments are character rows, so the command form works too: icp2d demo 7
%   Bad input raises an error icp2d:usage, icp2d:file or icp2d:parameter and prints nothing.
%
%   From a shell:
%       matlab -batch "addpath('book/ports/matlab'); icp2d('demo', '7')"
%       octave-cli --quiet --no-init-file --path book/ports/matlab ...
%           book/ports/matlab/icp2d_main.m demo 7
%
%   See also RUN_COMMAND, ICP, ICP_PARAMETERS.

if nargin == 0
    error('icp2d:usage', 'no command; known are match, align, integrate, demo, batch');
end
if strcmp(command, 'batch')
    if nargin ~= 2
        error('icp2d:usage', 'batch takes COMMANDS.txt, got %d arguments', nargin - 1);
    end
    run_batch(varargin{1});
else
    fprintf('%s\n', to_json(run_command([{command}, varargin], '')));
end
end
