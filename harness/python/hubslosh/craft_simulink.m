% The craft in Simulink (R2020b or newer): craft.fmu as a Co-Simulation block in a new model.
%
% Tried in Octave: everything up to "The model". UNTRIED: the rest, written from Simulink's
% documentation. The FMU starts with the values of the craft, so that no parameter has to be set.
% craft.mat has the linear model (A, B, C, D, states, inputs, outputs) at this fill from torque to q
% and omega (only to omega if the craft spins), the parameters (parameter_names, parameter_values)
% and the inputs at the start (input_names, input_values), in SI units.
%
%   >> craft_simulink

folder = fileparts(mfilename('fullpath'));
load(fullfile(folder, 'craft.mat'));
if ~isempty(which('ss'))
    craft = ss(A, B, C, D);
end

% The ports of the block have the order of the FMU's variables.
unpacked = tempname();
unzip(fullfile(folder, 'craft.fmu'), unpacked);
xml = fileread(fullfile(unpacked, 'modelDescription.xml'));
rmdir(unpacked, 's');
found = regexp(xml, '<@pattern@ name="([^"]+)"[^>]*causality="(\w+)"', 'tokens');
variables = cellfun(@(one) one{1}, found, 'UniformOutput', false);
causality = cellfun(@(one) one{2}, found, 'UniformOutput', false);
ports = variables(strcmp(causality, 'input'));
results = variables(strcmp(causality, 'output'));
assert(isequal(ports(:), input_names(:)), 'inputs: %s', strjoin(ports, ', '));
[known, places] = ismember({@shown@}, results);
assert(all(known), 'outputs: %s', strjoin(results, ', '));
fprintf('inputs: %s\n', strjoin(ports, ', '));
fprintf('output %d: %s\n', [num2cell(places); results(places)]{:});
if isempty(which('new_system'))
    fprintf('Simulink is not installed: no model is built\n');
    return
end

% The model
model = 'craft_example';
if bdIsLoaded(model)
    close_system(model, 0);
end
new_system(model);
add_block('simulink_extras/FMU Import/FMU', [model '/craft'], 'FMUName', ...
    fullfile(folder, 'craft.fmu'));
% The FMU has both interfaces. If your release of Simulink selects Model Exchange, choose
% Co-Simulation in the dialog of the block.
for k = 1:numel(ports)
    name = regexprep(ports{k}, '\W', '_');
    add_block('simulink/Sources/Constant', [model '/' name], 'Value', ...
        sprintf('%.17g', input_values(k)));
    add_line(model, [name '/1'], sprintf('craft/%d', k));
end
for k = 1:numel(places)
    name = regexprep(results{places(k)}, '\W', '_');
    add_block('simulink/Sinks/To Workspace', [model '/' name], 'VariableName', name, ...
        'SaveFormat', 'Timeseries');
    add_line(model, sprintf('craft/%d', places(k)), [name '/1']);
end
open_system(model);
