"""Runs HubSlosh as SSP in OMSimulator 3; tried with its sources of November 2025 on Linux.

    python harness/hosts/ssp.py dist/HubSlosh.fmu dist/HubSlosh.ssp
    OMSimulatorPython3 harness/hosts/omsimulator.py        # from the project's root
    python harness/hosts/compare.py dist/omsimulator_ssp.csv dist/HubSlosh.fmu \
        --prefix bench.plant. tank.h=0.05 slosh.modes=2 slosh.kind=4 \
        init.slosh_angle=0.1 init.omega=0.02

The system is that of ssp/, in which the liquid is released and no torque drives the hub.
"""

from OMSimulator import SSP, CRef, Settings

Settings.suppressPath = True
system = SSP("dist/HubSlosh.ssp").instantiate()
system.setResultFile("dist/omsimulator_ssp.csv")
# set slosh.kind, because OMSimulator removes "model" from the name slosh.model
system.setValue(CRef("bench", "plant", "slosh.kind"), 4)  # spherical
system.setFixedStepSize(0.02)  # s
system.initialize()
system.simulate()
print("slosh_angle", system.getValue(CRef("bench", "plant", "slosh_angle")), "rad")
system.terminate()
system.delete()
