% Compares generated MATLAB files with results of the interpreter; run by Octave as
% check(CASES.json) in the folder of this file. See check.py.
function check(path)
  cases = jsondecode(fileread(path), 'makeValidName', false);
  for k = 1:numel(cases)
    if iscell(cases)
      one = cases{k};
    else
      one = cases(k);
    end
    [folder, name] = fileparts(one.file);
    addpath(folder);
    model = feval(name);
    check_case(one, model.(one.function));
    rmpath(folder);
  end
  printf('%d functions agree\n', numel(cases));
end

function check_case(one, generated)
  n = one.points;
  n_outputs = numel(one.output_lens);
  inputs = split(one.flat_inputs, one.input_lens, n);
  expected = split(one.flat_outputs, one.output_lens, n);
  found = cell(1, n_outputs);
  for point = 1:n
    at_point = cellfun(@(a) a(:, point), inputs, 'UniformOutput', false);
    [found{:}] = generated(at_point{:});
    for k = 1:n_outputs
      compare(one.function, found{k}, expected{k}(:, point));
    end
  end
  if ~one.is_step
    [found{:}] = generated(inputs{:});
    for k = 1:n_outputs
      compare(one.function, found{k}, expected{k});
    end
  end
end

function arrays = split(flat, lens, n)
  % Matrices with a column a point, from points one after the other.
  rows = reshape(flat, sum(lens), n);
  arrays = cell(1, numel(lens));
  first = 0;
  for k = 1:numel(lens)
    arrays{k} = rows(first + 1:first + lens(k), :);
    first = first + lens(k);
  end
end

function compare(name, found, expected)
  difference = max([abs(found(:) - expected(:)); 0]);
  if ~isequal(size(found), size(expected)) || ~(difference <= 1e-11*(1 + max([abs(expected(:)); 0])))
    error('%s: off by %g', name, difference);
  end
end
