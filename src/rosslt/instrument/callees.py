"""The names on which the rules for literals rest: calls, keywords and attributes whose numbers are not locations."""

from typing import Set


def _words(text: str) -> Set[str]:
    return set(text.split())


#: Modules of which no function makes a number for a message.
PLAIN_MODULES = _words(
    """
    argparse ast asyncio bisect csv ctypes cv2 cv_bridge datetime errno fcntl getopt glob gzip hashlib importlib
    json logging matplotlib mmap multiprocessing optparse os pickle pigpio plt pygame queue re
    requests sched select serial shutil signal smbus socket sqlite3 ssl string struct subprocess sys tempfile
    termios threading time tkinter traceback tty unittest urllib uuid warnings yaml zlib zmq Queue GPIO PIL
    Image torch tensorflow usb
    """
)

#: Functions and classes whose numbers are counts, rates, times, sizes or codes.
PLAIN_CALLS = _words(
    """
    range xrange len bool str repr chr ord hex bin oct bytes bytearray print exit quit
    input Rate Duration Time Timer sleep from_sec from_seconds wait join wait_for_service
    wait_for_message wait_for_server wait_for_result wait_for_transform waitForTransform wait_for settimeout
    signal_shutdown spin_once acquire get_nowait send_goal_and_wait loginfo logwarn logerr logdebug logfatal
    loginfo_throttle logwarn_throttle logerr_throttle logdebug_throttle loginfo_once seed randint
    randrange sample getrandbits choices reshape resize astype set_printoptions pause figure subplot subplots
    hasattr isinstance super type format split rsplit ljust rjust zfill center recv recvfrom
    recv_into bind listen read readline write ioctl Semaphore Lock Event pop namedtuple partial_ratio crc16
    pack unpack pack_into unpack_from sizeof fromordinal strftime
    """
)

#: Functions that make arrays and the like: the index from which on their arguments are sizes, steps or types.
SHAPE_CALLS = {
    'enumerate': 1,
    'islice': 1,
    'deque': 1,
    'zeros': 0,
    'ones': 0,
    'empty': 0,
    'eye': 0,
    'identity': 0,
    'full': 99,
    'linspace': 2,
    'logspace': 2,
    'rand': 0,
    'randn': 0,
    'tile': 1,
    'repeat': 1,
    'round': 1,
    'combinations': 1,
    'permutations': 1,
    'roll': 1,
    'zeros_like': 1,
    'ones_like': 1,
}

#: The calls that read a parameter.
PARAMETER_CALLS = {'get_param', 'get_param_cached'}

#: The calls that pass on their arguments; their keywords select the range.
PASSING_ON = {'enumerate', 'islice', 'deque'}

#: Keywords whose numbers are options of a call.
PLAIN_KEYWORDS = _words(
    """
    queue_size latch timeout buff_size tcp_nodelay daemon oneshot axis axes dtype order copy ndmin decimals
    ddof seed size shape num endpoint indent base end sep flush maxlen maxsize period log_level cache_time
    poll precision baudrate baud bytesize stopbits parity preempt_timeout execute_timeout attempts max_retries
    retries keepdims nargs width backlog block slop allow_headerless logger_level rate hz frequency
    """
)

#: Keywords of options that are also fields of messages.
FIELDS = {'axes', 'width', 'size', 'shape'}

#: Attributes, keywords and names (in small letters) whose ints name, select or count.
COUNT_ATTRIBUTES = _words(
    """
    id type action mode status state seq row_step point_step count counter index idx num n channel channels
    port baud baudrate pin interaction_mode orientation_mode command_type code goal_status is_bigendian
    is_dense datatype class_id object_id robot_id marker_id button buttons device device_id camera_id version
    priority queue_size coordinate_frame type_mask sequence param_id mission_id
    """
)

#: Bases of classes whose numbers must be exactly ints.
ENUMERATIONS = {'Enum', 'IntEnum', 'Flag', 'IntFlag', 'Structure', 'Union', 'NamedTuple', 'TypedDict'}

#: Decorators of functions that another compiler reads.
STRICT_DECORATORS = {'jit', 'njit', 'vectorize', 'guvectorize', 'stencil', 'cfunc', 'script', 'compile', 'kernel'}

#: Functions that repeat themselves.
WAVES = {'sin', 'cos', 'tan', 'exp'}

#: Functions of which the first three arguments are angles about three axes.
TURN_CALLS = {'quaternion_from_euler', 'euler_matrix'}

#: Names of a turn or a part of it.
TURNS = {'pi', 'tau', 'PI', 'M_PI', 'TWO_PI', 'twopi'}

#: Factors between units.
UNITS = {
    60,
    180,
    360,
    1000,
    3600,
    1e3,
    1e6,
    1e9,
    1e-3,
    1e-6,
    1e-9,
    180.0,
    360.0,
    57.3,
    57.2958,
    0.0174533,
    1.0e5,
    100000,
}

#: Functions that tell the time.
CLOCKS = {'to_sec', 'to_nsec', 'get_time', 'time', 'monotonic', 'perf_counter', 'total_seconds', 'clock', 'now'}

#: Modules of which a function or a constant of numbers is a number.
MODULES_OF_NUMBERS = {'math', 'numpy', 'np', 'm'}

#: Functions that give random numbers.
CHANCE = {
    'random',
    'uniform',
    'gauss',
    'normal',
    'normalvariate',
    'rand',
    'randn',
    'random_sample',
    'standard_normal',
    'triangular',
    'betavariate',
    'expovariate',
}
