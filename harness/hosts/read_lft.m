function [G, parts] = read_lft(file, delta)
% READ_LFT  Uncertain model (M, Delta) of Spacecraft, written by hubslosh.to_mat.
%
%   G = read_lft('craft.mat')         uncertain state space by ureal and lft
%   G = read_lft('craft.mat', delta)  A, B, C, D in a struct at values of Delta, -1 to 1 each
%   [G, parts] = ...                  also the content of the file
%
% Delta is diagonal and real: parts.deltas{k} occurs parts.repetition(k) times. In physical units
% its parameter is parts.middle(k) + parts.radius(k)*delta(k).
% The first form needs MATLAB's Robust Control Toolbox and is UNTRIED: it has never been run. The
% second form is matrix arithmetic and works in MATLAB and Octave.

parts = load(file);
n = size(parts.A, 1);
w = double(parts.size_of_delta);
counts = double(parts.repetition(:));

if nargin < 2
    Delta = [];
    for k = 1:numel(counts)
        name = regexprep(parts.deltas{k}, '\W+', '_');
        name = regexprep(name, '_$', '');
        middle = parts.middle(k);
        radius = parts.radius(k);
        value = ureal(name, middle, 'Range', [middle - radius, middle + radius]);
        Delta = blkdiag(Delta, (value - middle)/radius*eye(counts(k)));
    end
    M = ss(parts.A, parts.B, parts.C, parts.D);
    G = lft(Delta, M); % the first inputs and outputs of M are those of Delta
    G.InputName = cellstr(parts.inputs);
    G.OutputName = cellstr(parts.outputs);
    return
end

assert(numel(delta) == numel(counts), 'Delta has %d values, but %d are given', numel(counts), numel(delta));
D_x = diag(repelem(delta(:), counts));
z = 1:w;
u = w + 1:size(parts.B, 2);
y = w + 1:size(parts.C, 1);
through = D_x/(eye(w) - parts.D(z, z)*D_x);
G.A = parts.A + parts.B(:, z)*through*parts.C(z, :);
G.B = parts.B(:, u) + parts.B(:, z)*through*parts.D(z, u);
G.C = parts.C(y, :) + parts.D(y, z)*through*parts.C(z, :);
G.D = parts.D(y, u) + parts.D(y, z)*through*parts.D(z, u);
end
