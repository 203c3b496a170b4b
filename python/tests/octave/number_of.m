% The number of a symbol: 1.1 + (7919 h mod m)/m, h = sum of c_i 31^(n-i) modulo m = 1000003.
function v = number_of(name)
  h = 0;
  for c = double(name)
    h = mod(31 * h + c, 1000003);
  end
  v = 1.1 + mod(7919 * h, 1000003) / 1000003;
end
