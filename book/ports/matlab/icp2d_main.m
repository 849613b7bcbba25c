%ICP2D_MAIN  The command line of the port for GNU Octave; a script.
%   octave-cli --quiet --no-init-file --path book/ports/matlab ...
%       book/ports/matlab/icp2d_main.m match TARGET.csv SOURCE.csv PARAMETERS.json
%
%   Bad input prints one line "icp2d: ..." to standard error and exits with status 1. MATLAB
%   has no ARGV and needs no script: see ICP2D.

history_save(false);   % a script has none; saving it may fail and say so at the exit
words = argv();
try
    icp2d(words{:});
catch mistake
    fprintf(2, 'icp2d: %s\n', regexprep(mistake.message, '\s+', ' '));
    exit(1);
end
