-- HubSlosh in OMSimulator 2 with both interfaces. In Co-Simulation a sine drives it; in Model
-- Exchange the liquid is released, with CVODE. Tried with 2.1.3 on Linux. OMSimulator 3 uses Python
-- instead of Lua: see omsimulator.py.
--
--   OMSimulator harness/hosts/omsimulator.lua        (from the project's root)
--   python harness/hosts/compare.py dist/omsimulator_cs.csv dist/HubSlosh.fmu --prefix cs.root.plant. --driven slosh.model=4 init.slosh_angle=0.3 init.omega=0.1
--   python harness/hosts/compare.py dist/omsimulator_me.csv dist/HubSlosh.fmu --prefix me.root.plant. slosh.model=4 init.slosh_angle=0.3 init.omega=0.1

local step = 0.02 -- s

local function check(status)
  if status ~= 0 then
    error("OMSimulator returned " .. status, 2)
  end
end

-- Creates a model with the FMU; kind is oms_system_wc for Co-Simulation, oms_system_sc for Model Exchange.
local function build(model, kind, stop)
  check(oms_newModel(model))
  check(oms_addSystem(model .. ".root", kind))
  check(oms_addSubModel(model .. ".root.plant", "dist/HubSlosh.fmu"))
  -- SI units; slosh.model: 1 frozen, 2 linear, 3 planar, 4 spherical, 5 liquid
  check(oms_setInteger(model .. ".root.plant.slosh.model", 4))
  check(oms_setReal(model .. ".root.plant.init.slosh_angle", 0.3))
  check(oms_setReal(model .. ".root.plant.init.omega", 0.1))
  check(oms_setResultFile(model, "dist/omsimulator_" .. model .. ".csv"))
  check(oms_setStopTime(model, stop))
  check(oms_setTolerance(model, 1e-9, 1e-9))
end

local function finish(model)
  print("omega", oms_getReal(model .. ".root.plant.omega"), "rad/s")
  check(oms_terminate(model))
  check(oms_delete(model))
end

oms_setCommandLineOption("--suppressPath=true")

build("cs", oms_system_wc, 60.0)
check(oms_setFixedStepSize("cs.root", step))
check(oms_instantiate("cs"))
check(oms_initialize("cs"))
-- OMSimulator sums its steps with rounding errors: with an end of n * step it sometimes takes one step more.
for n = 1, 60 / step do
  check(oms_setReal("cs.root.plant.tau_cmd", 0.05 * math.sin(2 * math.pi * 2.4 * (n - 1) * step)))
  check(oms_stepUntil("cs", n * step - 1e-9))
end
finish("cs")

build("me", oms_system_sc, 20.0)
check(oms_setSolver("me.root", oms_solver_sc_cvode))
check(oms_setVariableStepSize("me.root", 1e-6, 1e-12, 0.01)) -- first, smallest, largest, s
check(oms_instantiate("me"))
check(oms_initialize("me"))
check(oms_simulate("me"))
finish("me")
