"""The spin-up of Kane, Ryan & Banerjee with exudyn's finite elements.

The clamped node lies on the axis; a constraint prescribes its angle as a function of time that
exudyn evaluates without Python. Of exudyn's two builds the faster one is taken, without range
checks.
"""

import math
import sys
import time

import numpy as np

sys.exudynFast = True  # before the first import of exudyn

LENGTH, AXIAL, BENDING, MASS = 10.0, 2.8e7, 1.4e4, 1.2
SPEED, DURATION, END = 6.0, 15.0, 20.0
ELEMENTS = 32
# So stiff in shear that it does not count: 3 EI / (GA L^2) = 4e-5 of a tip deflection.
SHEAR = 1e7

# The words of exudyn. element: "exact" for geometrically exact ones of two nodes, or "cable" for
# those of absolute nodal coordinates.
SETTINGS = {
    "element": "exact",
    "step": 5e-3,
    "relativeTolerance": 1e-8,
    "absoluteTolerance": 1e-10,
    "useModifiedNewton": True,
    "modifiedNewtonJacUpdatePerStep": False,
    "spectralRadius": 0.9,
    "solverType": "EigenSparse",
    "reuseAnalyzedPattern": True,
}


def angle(t, cosine=math.cos, least=min, most=max):
    """Angle of the hub, rad."""
    wave = DURATION / (2.0 * math.pi)
    inside = least(t, DURATION)
    turned = 0.5 * inside * inside + wave * wave * (cosine(inside / wave) - 1.0)
    return SPEED / DURATION * turned + SPEED * most(t - DURATION, 0.0)


def _exact(mbs, items, constrain):
    """Geometrically exact elements."""
    import exudyn
    from exudyn.advancedUtilities import CreateSymbolicUserFunction

    symbols = exudyn.symbolic

    def offset(mbs, t, item, constant):
        return angle(t, symbols.cos, symbols.min, symbols.max)

    l = LENGTH / ELEMENTS
    nodes = [
        mbs.AddNode(items.NodeRigidBody2D(referenceCoordinates=[l * i, 0.0, 0.0]))
        for i in range(ELEMENTS + 1)
    ]
    for pair in zip(nodes[:-1], nodes[1:], strict=True):
        element = items.ObjectBeamGeometricallyExact2D(
            nodeNumbers=list(pair),
            length=l,
            massPerLength=MASS,
            bendingStiffness=BENDING,
            axialStiffness=AXIAL,
            shearStiffness=SHEAR,
        )
        mbs.AddObject(element)
    function = CreateSymbolicUserFunction(
        mbs, offset, "offsetUserFunction", itemTypeName="ObjectConnectorCoordinate"
    )
    constrain(nodes[0], 2, function)
    return nodes, [function]


def _cable(mbs, items, constrain):
    """Elements of absolute nodal coordinates; the root's slope is a unit vector, unstrained."""
    l = LENGTH / ELEMENTS
    nodes = [
        mbs.AddNode(items.NodePoint2DSlope1(referenceCoordinates=[l * i, 0.0, 1.0, 0.0]))
        for i in range(ELEMENTS + 1)
    ]
    for pair in zip(nodes[:-1], nodes[1:], strict=True):
        element = items.ObjectANCFCable2D(
            nodeNumbers=list(pair),
            length=l,
            massPerLength=MASS,
            bendingStiffness=BENDING,
            axialStiffness=AXIAL,
            useReducedOrderIntegration=2,
        )
        mbs.AddObject(element)
    functions = [
        lambda mbs, t, item, constant: math.cos(angle(t)) - 1.0,
        lambda mbs, t, item, constant: math.sin(angle(t)),
    ]
    for coordinate, function in zip((2, 3), functions, strict=True):
        constrain(nodes[0], coordinate, function)
    return nodes, functions


def spin_up(**changes):
    """Seconds of the run alone, and the tip's times and deflections; all None if it fails."""
    import exudyn
    from exudyn import itemInterface as items

    exudyn.config.printToConsole = False
    given = SETTINGS | changes
    mbs = exudyn.SystemContainer().AddSystem()
    ground = mbs.AddMarker(
        items.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(items.NodePointGround()), coordinate=0)
    )

    def constrain(node, coordinate, function=0):
        marker = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))
        mbs.AddObject(
            items.ObjectConnectorCoordinate(
                markerNumbers=[ground, marker], offsetUserFunction=function
            )
        )

    build = {"exact": _exact, "cable": _cable}[given["element"]]
    nodes, _keep = build(mbs, items, constrain)
    constrain(nodes[0], 0)
    constrain(nodes[0], 1)
    tip = mbs.AddSensor(
        items.SensorNode(
            nodeNumber=nodes[-1],
            storeInternal=True,
            writeToFile=False,
            outputVariableType=exudyn.OutputVariableType.Position,
        )
    )
    mbs.Assemble()
    settings = exudyn.SimulationSettings()
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = given["step"]
    settings.linearSolver.solverType = getattr(exudyn.LinearSolverType, given["solverType"])
    settings.linearSolver.reuseAnalyzedPattern = given["reuseAnalyzedPattern"]
    integration = settings.timeIntegration
    integration.endTime = END
    integration.numberOfSteps = round(END / given["step"])
    integration.generalizedAlpha.spectralRadius = given["spectralRadius"]
    for name in (
        "relativeTolerance",
        "absoluteTolerance",
        "useModifiedNewton",
        "modifiedNewtonJacUpdatePerStep",
    ):
        setattr(integration.newton, name, given[name])
    begin = time.perf_counter()
    try:
        mbs.SolveDynamic(settings)
    except Exception:  # what exudyn raises has no narrower type
        return None, None, None
    seconds = time.perf_counter() - begin
    t, x, y = np.array(mbs.GetSensorStoredData(tip))[:, :3].T
    turned = np.array([angle(s) for s in t])
    return seconds, t, y * np.cos(turned) - x * np.sin(turned)
