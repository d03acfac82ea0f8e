% HubSlosh in Simulink (R2020b or newer): a fresh model with the FMU as a Co-Simulation block, driven
% by a sine near the slosh frequency.
%
% UNTRIED: written from Simulink's documentation; nobody has run it.
%
%   >> cd harness/hosts
%   >> simulink

fmu = fullfile(pwd, '..', '..', 'dist', 'HubSlosh.fmu');
assert(isfile(fmu), 'there is no %s: cargo run --release -- pack --all-platforms', fmu);

model = 'hubslosh_example';
if bdIsLoaded(model)
    close_system(model, 0);
end
new_system(model);
plant = [model '/HubSlosh'];
add_block('simulink_extras/FMU Import/FMU', plant, 'FMUName', fmu);
% The FMU offers both interfaces. If your release has taken Model Exchange, choose Co-Simulation in
% the block's dialog, with 0.02 s as its step.

% Parameters in SI units. Simulink shows their dots as levels of a structure; an enumeration is set by
% the name of its item, and where a release wants none, slosh.kind takes the item's number.
mask = Simulink.Mask.get(plant);
settings = {'slosh_model', 'spherical'; 'tank_h', '0.05'; 'init_slosh_angle', '0.1'};
names = {mask.Parameters.Name};
for k = 1:size(settings, 1)
    % The name of a parameter's field is up to the release: dots may become underscores.
    here = find(strcmpi(regexprep(names, '[^A-Za-z0-9]', ''), strrep(settings{k, 1}, '_', '')), 1);
    assert(~isempty(here), 'no parameter %s among: %s', settings{k, 1}, strjoin(names, ', '));
    try
        set_param(plant, names{here}, settings{k, 2});
    catch refusal
        if ~strcmp(settings{k, 1}, 'slosh_model'), rethrow(refusal); end
        kind = find(strcmpi(regexprep(names, '[^A-Za-z0-9]', ''), 'sloshkind'), 1);
        set_param(plant, names{kind}, '4'); % spherical
    end
end

% Inputs in the order of the FMU: tau_cmd, tau_ext (N.m), g_axial (m/s2).
add_block('simulink/Sources/Sine Wave', [model '/tau_cmd'], ...
    'Amplitude', '0.05', 'Frequency', '2*pi*2.4', 'SampleTime', '0.02');
add_block('simulink/Sources/Constant', [model '/tau_ext'], 'Value', '0');
add_block('simulink/Sources/Constant', [model '/g_axial'], 'Value', '9.81');
add_line(model, 'tau_cmd/1', 'HubSlosh/1');
add_line(model, 'tau_ext/1', 'HubSlosh/2');
add_line(model, 'g_axial/1', 'HubSlosh/3');

% Outputs in the order of the FMU; 2 omega (rad/s), 4 slosh_angle, 6 slosh_angle_radial (rad).
shown = [2 4 6];
for k = 1:numel(shown)
    name = sprintf('out_%d', shown(k));
    add_block('simulink/Sinks/To Workspace', [model '/' name], ...
        'VariableName', name, 'SaveFormat', 'Timeseries');
    add_line(model, sprintf('HubSlosh/%d', shown(k)), [name '/1']);
end

set_param(model, 'StopTime', '60', 'SolverType', 'Fixed-step', 'FixedStep', '0.02');
result = sim(model);
labels = {'omega, rad/s', 'slosh angle, rad', 'radial slosh angle, rad'};
for k = 1:numel(shown)
    subplot(numel(shown), 1, k);
    plot(result.get(sprintf('out_%d', shown(k))));
    ylabel(labels{k});
end
xlabel('time, s');
