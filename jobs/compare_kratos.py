#!/usr/bin/env python3
"""One case of compare.py on KratosMPMApplication; run by it in a virtual environment.

compare_kratos.py beam|block FOLDER JSON: writes the model into FOLDER, runs it, prints a line of
JSON. The settings are those that compare.py gives to both programs.
"""
import json
import os
import resource
import sys
import time

import KratosMultiphysics as KM
import KratosMultiphysics.LinearSolversApplication
import KratosMultiphysics.MPMApplication as MPM
from KratosMultiphysics.MPMApplication.mpm_analysis import MpmAnalysis


class Lattice:
    """Boxes between `low` and `high`, `counts` along each axis; numbers start at 1."""

    def __init__(self, low, high, counts):
        self.low, self.counts = low, counts
        self.size = [(b - a) / n for a, b, n in zip(low, high, counts)]

    def node(self, index):
        number = 0
        for i, n in zip(reversed(index), reversed(self.counts)):
            number = number * (n + 1) + i
        return number + 1

    def indices(self, extra):
        """Of the nodes (extra = 1) or of the boxes (0), the first axis fastest."""
        from itertools import product
        for index in product(*[range(n + extra) for n in reversed(self.counts)]):
            yield index[::-1]

    def corners(self, index):
        plane = [(0, 0), (1, 0), (1, 1), (0, 1)]
        if len(index) == 2:
            return [self.node((index[0] + i, index[1] + j)) for i, j in plane]
        return [self.node((index[0] + i, index[1] + j, index[2] + k))
                for k in (0, 1) for i, j in plane]

    def position(self, index):
        x = [a + s * i for a, s, i in zip(self.low, self.size, index)]
        return x + [0.0] * (3 - len(x))


def write_mdpa(path, lattice, element, parts, loaded=None):
    """`parts`: {name: node numbers} or {name: None}, which holds everything."""
    with open(path, "w") as file:
        file.write("Begin ModelPartData\nEnd ModelPartData\nBegin Properties 0\nEnd Properties\n")
        file.write("Begin Nodes\n")
        for index in lattice.indices(1):
            x = lattice.position(index)
            file.write(f"{lattice.node(index)} {x[0]!r} {x[1]!r} {x[2]!r}\n")
        file.write(f"End Nodes\nBegin Elements {element}\n")
        elements = 0
        for index in lattice.indices(0):
            elements += 1
            file.write(f"{elements} 0 {' '.join(map(str, lattice.corners(index)))}\n")
        file.write("End Elements\n")
        if loaded:
            file.write("Begin Conditions MPMGridPointLoadCondition2D1N\n")
            file.write(f"1 0 {loaded}\nEnd Conditions\n")
        all_nodes = range(1, lattice.node(lattice.counts) + 1)
        for name, nodes in parts.items():
            file.write(f"Begin SubModelPart {name}\nBegin SubModelPartNodes\n")
            file.write("\n".join(map(str, all_nodes if nodes is None else nodes)))
            file.write("\nEnd SubModelPartNodes\n")
            if nodes is None:
                file.write("Begin SubModelPartElements\n")
                file.write("\n".join(map(str, range(1, elements + 1))))
                file.write("\nEnd SubModelPartElements\n")
            if loaded and nodes == [loaded]:
                file.write("Begin SubModelPartConditions\n1\nEnd SubModelPartConditions\n")
            file.write("End SubModelPart\n")


def fixed(part, axes):
    return {"python_module": "assign_vector_variable_process", "kratos_module": "KratosMultiphysics",
            "Parameters": {"model_part_name": f"Background_Grid.{part}",
                           "variable_name": "DISPLACEMENT", "interval": [0.0, "End"],
                           "constrained": [a in axes for a in "xyz"],
                           "value": [0.0 if a in axes else None for a in "xyz"]}}


def model(case, folder, s):
    """Files of the case; the processes that hold and load it."""
    grid_file, body_file = os.path.join(folder, "Grid"), os.path.join(folder, "Body")
    if case == "beam":
        h, n = s["h"], s["points"]
        grid = Lattice([0.0, 0.0], [11.0, 10.0], [round(11 / h), round(10 / h)])
        body = Lattice([0.0, 9.0], [10.0, 10.0], [round(10 / h) * n, round(1 / h) * n])
        left = [grid.node((0, j)) for j in range(grid.counts[1] + 1)]
        pin = [grid.node((0, round(9.5 / h)))]
        tip = grid.node((round(10 / h), round(9.5 / h)))
        write_mdpa(grid_file + ".mdpa", grid, "Element2D4N",
                   {"All": None, "Root": left, "Pin": pin, "Tip": [tip]}, tip)
        write_mdpa(body_file + ".mdpa", body, "MPMUpdatedLagrangian2D4N", {"Body": None})
        load = {"python_module": "apply_mpm_particle_neumann_condition_process",
                "kratos_module": "KratosMultiphysics.MPMApplication",
                "Parameters": {"model_part_name": "Background_Grid.Tip",
                               "variable_name": "POINT_LOAD", "modulus": f"{s['force']}*t",
                               "direction": [0.0, -1.0, 0.0]}}
        return [fixed("Root", "x"), fixed("Pin", "y")], [load]
    cells, n = s["cells"], s["points"]
    h = 1.0 / cells
    grid = Lattice([0.0] * 3, [1.0, 1.0, 1.0 + h], [cells, cells, cells + 1])
    body = Lattice([0.0] * 3, [1.0] * 3, [cells * n] * 3)
    sides = [[], [], []]
    for index in grid.indices(1):
        for axis in range(2):
            if index[axis] in (0, cells):
                sides[axis].append(grid.node(index))
        if index[2] == 0:
            sides[2].append(grid.node(index))
    write_mdpa(grid_file + ".mdpa", grid, "Element3D8N",
               {"All": None, "SidesX": sides[0], "SidesY": sides[1], "Base": sides[2]})
    write_mdpa(body_file + ".mdpa", body, "MPMUpdatedLagrangian3D8N", {"Body": None})
    return [fixed("SidesX", "x"), fixed("SidesY", "y"), fixed("Base", "z")], []


def parameters(case, folder, s, constraints, loads):
    space = 2 if case == "beam" else 3
    # Hencky elasticity: the Mohr-Coulomb law in logarithmic strains with a cohesion that nothing
    # reaches; or the cheaper neo-Hookean law.
    name = {"hencky": {2: "HenckyMCPlasticPlaneStrain2DLaw", 3: "HenckyMCPlastic3DLaw"},
            "neo-hookean": {2: "HyperElasticNeoHookeanPlaneStrain2DLaw",
                            3: "HyperElasticNeoHookean3DLaw"}}[s["law"]][space]
    variables = {"THICKNESS": 1.0, "MATERIAL_POINTS_PER_ELEMENT": 1, "DENSITY": s["density"],
                 "YOUNG_MODULUS": s["young"], "POISSON_RATIO": s["poisson"]}
    if s["law"] == "hencky":
        variables.update({"COHESION": 1e15, "INTERNAL_FRICTION_ANGLE": 0.1,
                          "INTERNAL_DILATANCY_ANGLE": 0.0})
    materials = os.path.join(folder, "materials.json")
    with open(materials, "w") as file:
        json.dump({"properties": [{
            "model_part_name": "Initial_MPM_Material.Body", "properties_id": 1,
            "Material": {"constitutive_law": {"name": name}, "Variables": variables,
                         "Tables": {}}}]}, file)
    solver = {
        "solver_type": "Static", "model_part_name": "MPM_Material", "domain_size": space,
        "echo_level": 0, "analysis_type": "non_linear", "compute_reactions": False,
        "model_import_settings": {"input_type": "mdpa",
                                  "input_filename": os.path.join(folder, "Body")},
        "grid_model_import_settings": {"input_type": "mdpa",
                                       "input_filename": os.path.join(folder, "Grid")},
        "material_import_settings": {"materials_filename": materials},
        "time_stepping": {"time_step": 1.0 / s["steps"]},
        "convergence_criterion": "residual_criterion",
        "residual_relative_tolerance": s["kratos_tolerance"], "residual_absolute_tolerance": 1e-12,
        "max_iteration": 20, "pressure_dofs": False, "auxiliary_variables_list": ["NORMAL"]}
    if s["linear"] != "default":
        solver["linear_solver_settings"] = s["linear"]
    return KM.Parameters(json.dumps({
        "problem_data": {"problem_name": case, "parallel_type": "OpenMP", "start_time": 0.0,
                         "end_time": 1.0 - 0.5 / s["steps"], "echo_level": 0},
        "solver_settings": solver,
        "processes": {"constraints_process_list": constraints, "loads_process_list": loads}}))


class Timed(MpmAnalysis):
    """Counts iterations and raises gravity with the load factor; what that takes from Python is
    not counted."""

    def __init__(self, model, parameters, gravity):
        super().__init__(model, parameters)
        self.gravity, self.iterations, self.outside, self.failed = gravity, [], 0.0, 0

    def InitializeSolutionStep(self):
        begin = time.perf_counter()
        if self.gravity:
            part = self.model["MPM_Material"]
            g = KM.Vector(3)
            g[2] = -self.gravity * min(self.time, 1.0)
            for element in part.Elements:
                element.SetValuesOnIntegrationPoints(MPM.MP_VOLUME_ACCELERATION, [g],
                                                     part.ProcessInfo)
        self.outside += time.perf_counter() - begin
        super().InitializeSolutionStep()

    def FinalizeSolutionStep(self):
        info = self.model["MPM_Material"].ProcessInfo
        self.iterations.append(info[KM.NL_ITERATION_NUMBER])
        super().FinalizeSolutionStep()


def main():
    case, folder, s = sys.argv[1], sys.argv[2], json.loads(sys.argv[3])
    os.makedirs(folder, exist_ok=True)
    KM.Logger.GetDefaultOutput().SetSeverity(KM.Logger.Severity.WARNING)
    constraints, loads = model(case, folder, s)
    begin, begin_cpu = time.perf_counter(), time.process_time()
    kratos = KM.Model()
    run = Timed(kratos, parameters(case, folder, s, constraints, loads), s.get("gravity", 0.0))
    run.Initialize()
    ready, ready_cpu = time.perf_counter(), time.process_time()
    run.RunSolutionLoop()
    run.Finalize()
    end, end_cpu = time.perf_counter(), time.process_time()
    part = kratos["MPM_Material"]
    positions = [e.CalculateOnIntegrationPoints(MPM.MP_COORD, part.ProcessInfo)[0]
                 for e in part.Elements]
    lowest = [min(x[a] for x in positions) for a in range(3)]
    highest = [max(x[a] for x in positions) for a in range(3)]
    print(json.dumps({
        "points": len(positions), "steps": len(run.iterations), "newton": sum(run.iterations),
        "seconds": end - ready - run.outside, "cpu": end_cpu - ready_cpu - run.outside,
        "setup": ready - begin, "low": lowest, "high": highest,
        "memory": 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss}))


if __name__ == "__main__":
    main()
