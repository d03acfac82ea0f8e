"""Simulates a craft with one tank for a minute and prints the largest rate."""

import hubslosh

sphere = {"density": 1010, "shape": {"sphere": {"radius": 0.4}}}
tanks = {"main": hubslosh.MountedTank(sphere, (0, 0, 0.2), modes=1, nu=0.9e-6)}
craft = hubslosh.Craft(900, [400, 380, 300], tanks=tanks, thrust=500)
start = craft.parameters("50%") | {"tank[1].p_dot_0[1,1]": 0.1}
run = hubslosh.simulate("Spacecraft", start, stop=60)
print(f"largest rate: {run['omega[2]'].abs().max():.3g} rad/s")
run.view("craft.html")
