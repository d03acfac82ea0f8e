-- HubSlosh in OMSimulator: Co-Simulation, a system of one FMU, saved as SSP and simulated.
--
-- UNTRIED: written from OMSimulator's documentation; nobody has run it.
--
--   OMSimulator harness/hosts/omsimulator.lua        (from the project's root)

local step = 0.02 -- s

oms_setCommandLineOption("--suppressPath=true")
oms_setTempDirectory("target/omsimulator")
oms_newModel("hubslosh")
oms_addSystem("hubslosh.root", oms_system_wc)
oms_addSubModel("hubslosh.root.plant", "dist/HubSlosh.fmu")

-- SI units; slosh.model: 1 frozen, 2 linear, 3 planar, 4 spherical, 5 paraboloid
oms_setInteger("hubslosh.root.plant.slosh.model", 4)
oms_setReal("hubslosh.root.plant.init.slosh_angle", 0.3)
oms_setReal("hubslosh.root.plant.init.omega", 0.1)

oms_setResultFile("hubslosh", "target/omsimulator/hubslosh.csv")
oms_setStopTime("hubslosh", 60.0)
oms_setFixedStepSize("hubslosh.root", step)
oms_export("hubslosh", "target/omsimulator/hubslosh.ssp")

oms_instantiate("hubslosh")
oms_initialize("hubslosh")
for n = 1, 60 / step do
  oms_setReal("hubslosh.root.plant.tau_cmd", 0.05 * math.sin(2 * math.pi * 2.4 * (n - 1) * step))
  oms_stepUntil("hubslosh", n * step)
end
print("omega", oms_getReal("hubslosh.root.plant.omega"), "rad/s")
oms_terminate("hubslosh")
oms_delete("hubslosh")
