function values = parse_numbers(words)
%PARSE_NUMBERS  Finite decimal numbers from words, NaN for any other word.
%   VALUES = PARSE_NUMBERS(WORDS) takes a cell array of character rows and gives doubles of
%   the same size. STR2DOUBLE alone would let pass 'Inf', '2i' and '1d3'.

decimal = '^[ \t]*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?[ \t]*$';
is_decimal = ~cellfun('isempty', regexp(words, decimal, 'once'));
values = nan(size(words));
values(is_decimal) = str2double(words(is_decimal));
values(isinf(values)) = NaN;   % 1e999
end
