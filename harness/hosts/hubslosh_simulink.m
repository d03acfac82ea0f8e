% HubSlosh in Simulink (R2020b or newer): a new model with the FMU as a Co-Simulation block, driven
% by a sine near the slosh frequency.
%
% Tried in Octave: everything up to "The model". UNTRIED: the rest, which follows Simulink's
% documentation and has never been run, because Octave has no Simulink.
%
%   >> cd harness/hosts
%   >> hubslosh_simulink                  % or first: fmu = 'path/HubSlosh.fmu';

if ~exist('fmu', 'var')
    fmu = fullfile(pwd, '..', '..', 'dist', 'HubSlosh.fmu');
end
assert(exist(fmu, 'file') == 2, '%s does not exist; create it with: cargo run --release -- pack --all-platforms', fmu);

% Parameters in SI units. Simulink shows their dots as levels of a structure or as underscores; an
% enumeration is set by the name of its item.
settings = {'slosh_model', 'spherical'; 'tank_h', '0.05'; 'init_slosh_angle', '0.1'};
letters = @(names) lower(regexprep(names, '[^A-Za-z0-9]', ''));

% Ports have the order of the FMU's variables.
unpacked = tempname();
unzip(fmu, unpacked);
xml = fileread(fullfile(unpacked, 'modelDescription.xml'));
rmdir(unpacked, 's');
found = regexp(xml, '<ScalarVariable name="([^"]+)"[^>]*causality="(\w+)"', 'tokens');
variables = cellfun(@(one) one{1}, found, 'UniformOutput', false);
causality = cellfun(@(one) one{2}, found, 'UniformOutput', false);
inputs = variables(strcmp(causality, 'input'));
outputs = variables(strcmp(causality, 'output'));
assert(isequal(inputs(:), {'tau_cmd'; 'tau_ext'; 'g_axial'}), 'inputs: %s', strjoin(inputs, ', '));
shown = {'omega', 'slosh_angle', 'slosh_angle_radial'};
[known, ports] = ismember(shown, outputs);
assert(all(known), 'outputs: %s', strjoin(outputs, ', '));
known = ismember(letters(settings(:, 1)), letters(variables(strcmp(causality, 'parameter'))));
assert(all(known), 'the FMU has no parameter %s', strjoin(settings(~known, 1), ', '));
fprintf('inputs: %s\n', strjoin(inputs, ', '));
for k = 1:numel(shown)
    fprintf('output %d: %s\n', ports(k), shown{k});
end
if isempty(which('new_system'))
    fprintf('Simulink is missing: no model is built\n');
    return
end

% The model
model = 'hubslosh_example';
if bdIsLoaded(model)
    close_system(model, 0);
end
new_system(model);
plant = [model '/HubSlosh'];
add_block('simulink_extras/FMU Import/FMU', plant, 'FMUName', fmu);
% The FMU has both interfaces. If your release chooses Model Exchange, select Co-Simulation with a
% step of 0.02 s in the block's dialog.

mask = Simulink.Mask.get(plant);
names = {mask.Parameters.Name};
for k = 1:size(settings, 1)
    here = find(strcmp(letters(names), letters(settings{k, 1})), 1);
    assert(~isempty(here), 'the block has no parameter %s among: %s', settings{k, 1}, strjoin(names, ', '));
    try
        set_param(plant, names{here}, settings{k, 2});
    catch refusal
        % if a release sets no enumerations, set slosh.kind to the item's number
        if ~strcmp(settings{k, 1}, 'slosh_model'), rethrow(refusal); end
        kind = find(strcmp(letters(names), 'sloshkind'), 1);
        set_param(plant, names{kind}, '4'); % spherical
    end
end

add_block('simulink/Sources/Sine Wave', [model '/tau_cmd'], ...
    'Amplitude', '0.05', 'Frequency', '2*pi*2.4', 'SampleTime', '0.02'); % N.m, rad/s, s
add_block('simulink/Sources/Constant', [model '/tau_ext'], 'Value', '0'); % N.m
add_block('simulink/Sources/Constant', [model '/g_axial'], 'Value', '9.81'); % m/s2
for k = 1:numel(inputs)
    add_line(model, [inputs{k} '/1'], sprintf('HubSlosh/%d', k));
end
for k = 1:numel(shown)
    add_block('simulink/Sinks/To Workspace', [model '/' shown{k}], ...
        'VariableName', shown{k}, 'SaveFormat', 'Timeseries');
    add_line(model, sprintf('HubSlosh/%d', ports(k)), [shown{k} '/1']);
end

set_param(model, 'StopTime', '60', 'SolverType', 'Fixed-step', 'FixedStep', '0.02');
result = sim(model);
labels = {'omega, rad/s', 'slosh angle, rad', 'radial slosh angle, rad'};
for k = 1:numel(shown)
    subplot(numel(shown), 1, k);
    plot(result.get(shown{k}));
    ylabel(labels{k});
end
xlabel('time, s');
