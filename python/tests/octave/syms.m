% Gives every symbol a number of its own instead.
function syms(varargin)
  for i = 1:numel(varargin)
    name = varargin{i};
    assignin('caller', name, number_of(name));
  end
end
