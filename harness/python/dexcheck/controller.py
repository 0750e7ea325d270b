"""Controllers of one's own: what they are given at each step, and how they answer (controller_protocol.h)."""

import inspect
import os
import socket
import struct
import time
import traceback

import numpy as np

_TERMS, _TELLS_F_N, _PARAMETERS = 1, 2, 4
_MAGIC, _PROTOCOL = b"DEXCTRL\0", 1
_STEP, _BEGIN, _END, _SET_PARAMETERS, _ERROR = 1, 2, 3, 4, 5
_HELLO = struct.Struct("=8s6I17d")
_MESSAGE = struct.Struct("=II")
# To sleep and be woken by another core takes longer than a step: a wait begins so long awake, s, if the last was over by then.
_AWAKE = 300e-6


class InputError(ValueError):
    """What is wrong with a file or an argument, in one line."""


class RunError(RuntimeError):
    """A run or study that did not come to its end; what it says is the line of the program."""


class ParameterError(TypeError):
    """A parameter that a controller does not take."""


class Robot:
    """What a controller may know before the run.

    n velocities, p positions and N contacts; time_step between two calls, s; K_p and K_v: of the joints (n), or without a
    motion of joints of the object (6); mu, f_min, f_max and barrier_weight of the grasp force; the texts of parameter file and scenario.
    """

    def __init__(self, connection):
        magic, protocol, p, n, contacts, robot_bytes, scenario_bytes, *numbers = _HELLO.unpack(
            _receive(connection, _HELLO.size))
        if magic != _MAGIC or protocol != _PROTOCOL:
            raise ValueError(f"the program speaks protocol {protocol}, this module {_PROTOCOL}")
        self.p, self.n, self.N = p, n, contacts
        self.robot_text = _receive(connection, robot_bytes).decode()
        self.scenario_text = _receive(connection, scenario_bytes).decode()
        self.time_step = numbers[0]
        self.K_v, self.K_p = np.array(numbers[1:7]), np.array(numbers[7:13])
        self.mu, self.f_min, self.f_max, self.barrier_weight = numbers[13:17]
        if contacts == 0:
            self.K_p, self.K_v = np.frombuffer(_receive(connection, 16 * n)).reshape(2, n)


class State:
    """The measured state at a step, what should be done, and the model's terms there. Arrays are the same ones at each
    step, with new numbers: copy what is to be kept."""

    def __init__(self, robot, terms):
        p, n, N, k = robot.p, robot.n, robot.N, 3 * robot.N
        fields = {"_t": (1,), "X_d": (6,), "X_d_dot": (6,), "X_d_ddot": (6,), "q": (p,), "v": (n,), "R_Bo": (3, 3),
                  "p_Bo": (3,), "V_Bo": (6,), "X_o": (6,), "kappa": (N, 5), "overlap": (N,), "touching": (N,),
                  "_support": (1,)}
        if N == 0:
            fields.update(q_d=(n,), v_d=(n,), a_d=(n,))
        if terms:
            fields.update(M=(n, n), C=(n, n), gravity=(n,), friction=(n,), J_B=(k, n), J_B_dot=(k, n), G=(6, k),
                          G_dot=(6, k), M_hat=(6, 6), C_hat_V=(6,), N_o=(6,), sigma_prime=(n,), E_bar_inverse=(2, 2))
        self.data = np.zeros(sum(int(np.prod(shape)) for shape in fields.values()))
        at = 0
        for name, shape in fields.items():
            count = int(np.prod(shape))
            setattr(self, name, self.data[at:at + count].reshape(shape))
            at += count

    @property
    def t(self):
        """s, since the run, or the rest before it, began."""
        return float(self._t[0])

    @property
    def support_force(self):
        """Upward, on the object by what it lies on, N."""
        return float(self._support[0])


class Controller:
    """A controller of one's own: derive from it and define step. One object may make several runs.

    parameters: names and values of its own, which it has as attributes; a run may change them (controller.NAME of the
    scenario, --set, a study's keys). terms: whether its state has the model's terms. reports_F_N: whether step returns the
    internal force F_N (3 N) behind the torques, which a check of the paper's law needs.
    """

    parameters = {}
    terms = True
    reports_F_N = False

    def __init_subclass__(cls):
        for name, value in cls.parameters.items():
            setattr(cls, name, value)

    def __init__(self, **parameters):
        self._set(parameters)

    def _set(self, values):
        for name, value in values.items():
            if name not in self.parameters:
                takes = "takes " + ", ".join(self.parameters) if self.parameters else "takes none"
                raise ParameterError(f"controller.{name}: is none of its parameters: it {takes}")
            setattr(self, name, float(value))

    def start(self, robot):
        """Before a run: what is known of it."""

    def begin(self):
        """All has come to rest, and the run begins."""

    def step(self, state):
        """The torques (n), N m: of the right and left wheel, then of the joints."""
        raise NotImplementedError("step is not defined")


class _Function(Controller):
    """A function step(state, NAME=VALUE...) as a controller; what has a default is a parameter."""

    def __init__(self, function):
        self.function = function
        self.parameters = {name: one.default for name, one in inspect.signature(function).parameters.items()
                           if isinstance(one.default, (int, float))}
        super().__init__(**self.parameters)

    def _set(self, values):
        super()._set(values)
        chosen = {name: getattr(self, name) for name in self.parameters}
        self.step = lambda state: self.function(state, **chosen)


def as_controller(law):
    return law if isinstance(law, Controller) else _Function(law)


def describe(error):
    """The exception on one line, with the place where it was raised."""
    if isinstance(error, ParameterError):
        return str(error)
    frames = traceback.extract_tb(error.__traceback__)
    place = f" ({frames[-1].filename.rpartition('/')[2]}:{frames[-1].lineno})" if frames else ""
    text = " ".join(str(error).split())
    return f"{type(error).__name__}: {text}{place}"


def _receive(connection, size):
    data = bytearray(size)
    _receive_into(connection, memoryview(data))
    return bytes(data)


def _receive_into(connection, view, awake=0.0):
    """@param awake: how long it looks before it sleeps, s."""
    until = time.monotonic() + awake
    while view:
        looks = awake > 0 and time.monotonic() < until
        try:
            got = connection.recv_into(view, 0, socket.MSG_DONTWAIT if looks else socket.MSG_WAITALL)
        except BlockingIOError:
            os.sched_yield()
            continue
        if got == 0:
            raise EOFError
        view = view[got:]


def refuse(connection, text):
    """Greets, and says in one line why no controller follows."""
    try:
        Robot(connection)
        _greet(connection, _PARAMETERS)
        _receive(connection, _MESSAGE.size)
    except (EOFError, OSError):
        return
    _send_error(connection, text)


def _send_error(connection, text):
    data = text.encode()[:1000]
    try:
        connection.sendall(_MESSAGE.pack(_ERROR, len(data)) + data)
    except OSError:
        pass


def _greet(connection, flags):
    connection.sendall(struct.pack("=8sII", _MAGIC, _PROTOCOL, flags))


def _serve_steps(connection, controller):
    robot = Robot(connection)
    flags = _PARAMETERS | (_TERMS if controller.terms else 0) | (_TELLS_F_N if controller.reports_F_N else 0)
    _greet(connection, flags)
    state = State(robot, controller.terms)
    into = memoryview(state.data).cast("B")
    shape = (robot.n,)
    reply = np.zeros(1 + robot.n + (3 * robot.N if controller.reports_F_N else 0))
    reply[:1] = np.frombuffer(_MESSAGE.pack(_STEP, len(reply) - 1))
    torques, F_N = reply[1:1 + robot.n], reply[1 + robot.n:]
    header = memoryview(bytearray(_MESSAGE.size))
    awake = _AWAKE
    while True:
        begin = time.monotonic()
        _receive_into(connection, header, awake)
        awake = _AWAKE if time.monotonic() - begin < _AWAKE else 0.0
        kind, size = _MESSAGE.unpack(header)
        if kind == _STEP:
            _receive_into(connection, into)
            tau = _ask(controller.step, state)
            if controller.reports_F_N:
                tau, F_N[:] = tau
            if np.iscomplexobj(tau):
                raise ValueError("step must return real torques, got complex ones")
            tau = np.asarray(tau, dtype=float)
            if tau.shape != shape:
                raise ValueError(f"step must return {robot.n} torques, got an array of shape {tau.shape}")
            torques[:] = tau
            connection.sendall(reply)
        elif kind == _SET_PARAMETERS:
            lines = _receive(connection, size).decode().splitlines()
            controller._set({name: value for name, _, value in (line.rpartition(" ") for line in lines)})
            _ask(controller.start, robot)
            connection.sendall(_MESSAGE.pack(_SET_PARAMETERS, 0))
        elif kind == _BEGIN:
            _ask(controller.begin)
        else:
            return


class _LawFailure(Exception):
    """An exception of a law, its cause: an OSError of a law is none of the connection's."""


def _ask(function, *arguments):
    try:
        return function(*arguments)
    except (Exception, SystemExit) as error:
        raise _LawFailure from error


def serve(connection, law):
    """Answers one run over a socket. Returns the exception that the controller raised, None without."""
    controller = as_controller(law)
    own = {name: getattr(controller, name) for name in controller.parameters}
    try:
        _serve_steps(connection, controller)
    except (EOFError, OSError):
        pass  # the run has ended
    except _LawFailure as failure:
        _send_error(connection, describe(failure.__cause__))
        return failure.__cause__
    except Exception as error:  # what the law returned
        _send_error(connection, describe(error))
        return error
    finally:
        controller._set(own)  # another run begins with them
    return None
