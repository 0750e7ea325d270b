#pragma once

// The grasp-force problem as a semidefinite program for the program `csdp`.

#include <filesystem>

#include "controller/grasp/grasp_force.h"

namespace dexcheck::testing {

/// Writes `problem` in SDPA's sparse format: with f_c = G^+ F_o + Z x, the columns of Z a basis of null(G),
/// minimise the sum of normal forces over x subject to P_i(f_ci) >= 0 (2 x 2 blocks) and all bounds (a
/// diagonal block).
void WriteSdp(const GraspForceProblem& problem, const std::filesystem::path& file);

/// Runs csdp on a file written by WriteSdp, in the file's folder; returns csdp's exit code. The solution
/// lands in `file` with ".sol" appended.
int RunCsdp(const std::filesystem::path& file);

}  // namespace dexcheck::testing
