#pragma once

// The functions of the shared library that the Python package `dexcheck` calls (dexcheck/robot.py): robots
// with their terms, and logs. They have C linkage and plain types, so that one library serves every version
// of Python.
//
// A function that fails returns null or false; dexcheck_error() then says why, in one line. Arrays are of
// doubles, matrices row by row, and have the sizes that the object's description gives. Texts are JSON in
// UTF-8 and live as long as their object.

namespace dexcheck {

struct PythonObject;

// Names are those of C. NOLINTBEGIN(readability-identifier-naming)
extern "C" {

/// The message of this thread's last failed call. The first character is its kind: 'i' for an InputError, 'v'
/// for a ValueError.
const char* dexcheck_error();

/// The version of the program that this library belongs to.
const char* dexcheck_version();

/// A robot of a parameter file (TOML), a URDF or an MJCF. @param packages folders of a URDF's packages, one a
/// line.
PythonObject* dexcheck_load(const char* file, bool floating, const char* packages);

/// The signals of a run's log.h5.
PythonObject* dexcheck_open_log(const char* file);

/// Frees a robot or a log.
void dexcheck_free(PythonObject* object);

/// A robot's name, joints, frames, nq, nv and notes; a log's rows and signals (name, unit, width, columns).
const char* dexcheck_describe(PythonObject* object);

/// Impossible or suspicious things in a robot's description: a list of lines.
const char* dexcheck_audit(PythonObject* robot);

/// One term of a robot at positions q (nq) and velocities v (nv). @param term 'M' or 'C' (nv x nv), 'c', 'g',
/// 'h' or 'f' for viscous friction (nv), 'e' for the kinetic and the potential energy (2).
bool dexcheck_term(PythonObject* robot, char term, const double* q, const double* v, double* value);

/// The pose of a frame or link in the world, 4 x 4.
bool dexcheck_pose(PythonObject* robot, const char* name, const double* q, double* pose);

/// The body Jacobian of a frame, 6 x nv: [linear; angular] along the frame's axes.
bool dexcheck_jacobian(PythonObject* robot, const char* frame, const double* q, double* jacobian);

/// A signal of a log, rows x width, in its unit.
bool dexcheck_signal(PythonObject* log, const char* name, double* values);

}  // extern "C"
// NOLINTEND(readability-identifier-naming)

}  // namespace dexcheck
