% Prints what f and h are worth, instead of saving them.
function save(name, varargin)
  f = evalin('caller', 'f');
  h = evalin('caller', 'h');
  printf('model %s\n', name);
  printf('f'); printf(' %.17g', f); printf('\n');
  printf('h'); printf(' %.17g', h); printf('\n');
end
