"""The thrown block of validation/cases/braking-block by Siconos, in a process of its own: siconos_peer.py STEP

Moreau and Jean's time steps with theta = 1/2, one contact of a point of mass: what a block that does
not tilt is. Prints place [m] and processor time after the imports [s].
"""
import subprocess
import sys

from common import PYTHON, debian_version


def version():
    return debian_version("Siconos", "python3-siconos", "siconos.kernel")


def solve(step):
    done = subprocess.run([PYTHON, __file__, str(step)], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError((done.stderr.strip().splitlines() or ["no word"])[-1][:200])
    place, seconds = map(float, done.stdout.split()[-2:])
    return place, seconds


def main(step):
    import time

    import numpy
    import siconos.kernel as kernel
    import siconos.numerics as numerics

    start = time.process_time()
    # kept by name: the library holds no copy of the arrays
    place, velocity, mass = numpy.zeros(3), numpy.array([3.0, 0, 0]), numpy.eye(3)
    weight, turned, offset = numpy.array([0, 0, -9.81]), numpy.eye(3)[[2, 0, 1]], numpy.zeros(3)
    block = kernel.LagrangianLinearTIDS(place, velocity, mass)
    block.setFExtPtr(weight)
    touch = kernel.Interaction(kernel.NewtonImpactFrictionNSL(0, 0, 0.4, 3),
                               kernel.LagrangianLinearTIR(turned, offset))
    model = kernel.NonSmoothDynamicalSystem(0, 0.9)
    model.insertDynamicalSystem(block)
    model.link(touch, block)
    problem = kernel.FrictionContact(3)
    problem.numericsSolverOptions().dparam[numerics.SICONOS_DPARAM_TOL] = 1e-12
    simulation = kernel.TimeStepping(model, kernel.TimeDiscretisation(0, float(step)),
                                     kernel.MoreauJeanOSI(0.5), problem)
    while simulation.hasNextEvent():
        simulation.computeOneStep()
        simulation.nextStep()
    print(block.q()[0], time.process_time() - start)


if __name__ == "__main__":
    main(*sys.argv[1:])
