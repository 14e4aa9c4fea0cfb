"""Engines that live in Python, as processes of the race: a scene comes as a line of JSON, then a word a line.

"step" takes a step and answers [wall seconds, processor seconds], "poses" place and rotation of every body,
"contacts" the number of contact points, "end" ends. What goes wrong is answered as {"error": text}.
"""

import json
import math
import sys
import time


class Pymunk:
    """The plane. Everything at its default but gravity and friction."""

    def __init__(self, scene):
        """Translate a scene."""
        import pymunk

        self.space = pymunk.Space()
        self.space.gravity = tuple(scene["gravity"])
        self.dt = scene["dt"]
        self.bodies = []
        kinds = {
            "dynamic": pymunk.Body.DYNAMIC,
            "fixed": pymunk.Body.STATIC,
            "kinematic": pymunk.Body.KINEMATIC,
        }
        for given in scene["bodies"]:
            body = pymunk.Body(body_type=kinds[given["kind"]])
            cosine, sine = given["rotation"]
            body.position = tuple(given["position"])
            body.angle = math.atan2(sine, cosine)
            body.velocity = tuple(given["velocity"])
            body.angular_velocity = given["spin"][0]
            self.space.add(body)
            for part in given["parts"]:
                shape = self.shape(pymunk, body, part)
                if given["kind"] == "dynamic":
                    shape.density = given["density"]
                # coefficients of a pair are multiplied
                shape.friction = math.sqrt(scene["friction"])
                self.space.add(shape)
            self.bodies.append(body)

    @staticmethod
    def shape(pymunk, body, part):
        """Make a shape at its place in the body's frame."""
        shape, (x, y), (c, s) = part["shape"], part["position"], part["rotation"]
        place = pymunk.Transform(c, s, -s, c, x, y)
        kind = shape["type"]
        if kind == "circle":
            return pymunk.Circle(body, shape["radius"], (x, y))
        if kind == "capsule":
            half = 0.5 * shape["length"]
            ends = [(x + side * half * c, y + side * half * s) for side in (-1, 1)]
            return pymunk.Segment(body, *ends, shape["radius"])
        if kind == "box":
            w, h = (0.5 * side for side in shape["size"])
            return pymunk.Poly(body, [(-w, -h), (w, -h), (w, h), (-w, h)], place)
        if kind == "convex_polygon":
            return pymunk.Poly(body, [tuple(p) for p in shape["points"]], place)
        raise ValueError(f"no {kind}")

    def step(self):
        """Take one step."""
        self.space.step(self.dt)

    def poses(self):
        """Tell the place [m] and rotation of every body, in the scene's order."""
        return [[*b.position, math.cos(b.angle), math.sin(b.angle)] for b in self.bodies]

    def contacts(self):
        """Count the contact points of the last step."""
        import pymunk

        found = 0
        for body in self.bodies:
            if body.body_type == pymunk.Body.DYNAMIC:
                counts = []
                body.each_arbiter(
                    lambda arbiter, counts=counts: counts.append(
                        len(arbiter.contact_point_set.points)
                        * (1 if all(s.body.body_type == pymunk.Body.DYNAMIC for s in arbiter.shapes) else 2)
                    )
                )
                found += sum(counts)
        # seen from both sides, or counted twice
        return found // 2


class Mujoco:
    """Space. Defaults but for gravity, friction and the step's length: Newton, a pyramidal cone."""

    def __init__(self, scene):
        """Translate a scene."""
        import mujoco

        self.mujoco = mujoco
        parts = []
        for given in scene["bodies"]:
            if given["kind"] == "kinematic":
                raise ValueError("no bodies with a prescribed motion")
            free = given["kind"] == "dynamic"
            geoms = "".join(self.geom(part, given["density"], scene["friction"]) for part in given["parts"])
            place = f'pos="{numbers(given["position"])}" quat="{numbers(given["rotation"])}"'
            parts.append(f"<body {place}>{'<freejoint/>' if free else ''}{geoms}</body>")
        option = f'<option timestep="{scene["dt"]!r}" gravity="{numbers(scene["gravity"])}"/>'
        text = f'<mujoco>{option}<size memory="1G"/><worldbody>{"".join(parts)}</worldbody></mujoco>'
        self.model = mujoco.MjModel.from_xml_string(text)
        self.data = mujoco.MjData(self.model)
        at = 0
        self.bodies = []
        for k, given in enumerate(scene["bodies"]):
            free = given["kind"] == "dynamic"
            self.bodies.append((k, at if free else None))
            if free:
                speed = self.model.jnt_dofadr[len([b for b in self.bodies if b[1] is not None]) - 1]
                self.data.qvel[speed : speed + 3] = given["velocity"]
                at += 7
        self.fixed = [(g["position"], g["rotation"]) for g in scene["bodies"]]

    @staticmethod
    def geom(part, density, friction):
        """Write a shape at its place in the body's frame."""
        shape = part["shape"]
        kind = shape["type"]
        if kind == "sphere":
            size = f'type="sphere" size="{shape["radius"]!r}"'
        elif kind == "capsule":
            size = f'type="capsule" size="{shape["radius"]!r} {0.5 * shape["length"]!r}"'
        elif kind == "box":
            size = f'type="box" size="{numbers([0.5 * s for s in shape["size"]])}"'
        else:
            raise ValueError(f"no {kind}")
        place = f'pos="{numbers(part["position"])}" quat="{numbers(part["rotation"])}"'
        return f'<geom {size} {place} density="{density!r}" friction="{friction!r} 0.005 0.0001"/>'

    def step(self):
        """Take one step."""
        self.mujoco.mj_step(self.model, self.data)

    def poses(self):
        """Tell the place [m] and rotation of every body, in the scene's order."""
        told = []
        for k, at in self.bodies:
            if at is None:
                place, turn = self.fixed[k]
                told.append([*place, *turn])
            else:
                told.append(self.data.qpos[at : at + 7].tolist())
        return told

    def contacts(self):
        """Count the contact points of the last step."""
        return int(self.data.ncon)


def numbers(values):
    """Write numbers as MuJoCo reads them."""
    return " ".join(repr(float(v)) for v in values)


def answer(value):
    """Answer the race."""
    print(json.dumps(value), flush=True)


def main():
    """Do as the race says until it ends."""
    engines = {"pymunk": Pymunk, "mujoco": Mujoco}
    try:
        engine = engines[sys.argv[1]](json.loads(sys.stdin.readline()))
    except Exception as problem:  # the race is told whatever it is, and goes on without
        answer({"error": f"{type(problem).__name__}: {problem}"})
        return
    answer({})
    for word in sys.stdin:
        word = word.strip()
        if word == "end":
            return
        try:
            if word == "step":
                wall, cpu = time.perf_counter(), time.process_time()
                engine.step()
                answer([time.perf_counter() - wall, time.process_time() - cpu])
            else:
                answer({"poses": engine.poses, "contacts": engine.contacts}[word]())
        except Exception as problem:
            answer({"error": f"{type(problem).__name__}: {problem}"})
            return


main()
