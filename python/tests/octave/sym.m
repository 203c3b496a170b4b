% sym('x', [n 1]): the numbers of x1, x2, ...; of what is a number, itself.
function v = sym(name, varargin)
  if ~ischar(name)
    v = name;
  elseif isempty(varargin)
    v = number_of(name);
  else
    n = prod(varargin{1});
    v = zeros(n, 1);
    for i = 1:n
      v(i) = number_of(sprintf('%s%d', name, i));
    end
  end
end
