#include "tests/controller/grasp/sdp_oracle.h"

#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <string>

#include "tests/common/linear_algebra.h"

namespace dexcheck::testing {
namespace {

// f_c = offset + basis x for all x.
struct ForceSpace {
  VectorXd offset;
  MatrixXd basis;
};

ForceSpace CalcForceSpace(const GraspForceProblem& problem) {
  ForceSpace space;
  space.offset = CalcPseudoinverse(problem.G) * problem.F_o;
  space.basis = CalcNullspace(problem.G);
  return space;
}

// One line "matrix block row column value" for each matrix F_0 (negated constant) and F_k of the affine entry
// constant + coefficients^T f_c.
void WriteEntry(std::ostream& out, const ForceSpace& space, int block, int row, int col, double constant,
                const VectorXd& coefficients) {
  out << "0 " << block << ' ' << row << ' ' << col << ' ' << -(constant + coefficients.dot(space.offset))
      << '\n';
  const VectorXd reduced = space.basis.transpose() * coefficients;
  for (Eigen::Index k = 0; k < reduced.size(); ++k) {
    out << k + 1 << ' ' << block << ' ' << row << ' ' << col << ' ' << reduced[k] << '\n';
  }
}

VectorXd CalcCost(const GraspForceProblem& problem) {
  VectorXd cost = VectorXd::Zero(problem.G.cols());
  for (Eigen::Index i = 0; i < problem.num_contacts(); ++i) cost[3 * i + 2] = 1.0;
  return cost;
}

}  // namespace

void WriteSdp(const GraspForceProblem& problem, const std::filesystem::path& file) {
  const ForceSpace space = CalcForceSpace(problem);
  const int n = problem.num_contacts();
  std::ofstream out(file);
  out << std::setprecision(17) << space.basis.cols() << '\n' << n + 1 << '\n';
  for (int i = 0; i < n; ++i) out << "2 ";
  out << -2 * n << '\n' << (space.basis.transpose() * CalcCost(problem)).transpose() << '\n';

  for (int i = 0; i < n; ++i) {
    const VectorXd f1 = VectorXd::Unit(3 * n, 3 * i);
    const VectorXd f2 = VectorXd::Unit(3 * n, 3 * i + 1);
    const VectorXd f3 = VectorXd::Unit(3 * n, 3 * i + 2);
    WriteEntry(out, space, i + 1, 1, 1, 0.0, problem.mu[i] * f3 + f1);
    WriteEntry(out, space, i + 1, 1, 2, 0.0, f2);
    WriteEntry(out, space, i + 1, 2, 2, 0.0, problem.mu[i] * f3 - f1);
    WriteEntry(out, space, n + 1, 2 * i + 1, 2 * i + 1, -problem.f_min[i], f3);
    WriteEntry(out, space, n + 1, 2 * i + 2, 2 * i + 2, problem.f_max[i], -f3);
  }
}

int RunCsdp(const std::filesystem::path& file) {
  // csdp reads its parameters from param.csdp: tighter than its defaults, and no perturbation of the
  // objective.
  std::ofstream(file.parent_path() / "param.csdp")
      << "axtol=1.0e-9\natytol=1.0e-9\nobjtol=1.0e-9\npinftol=1.0e8\ndinftol=1.0e8\nmaxiter=100\n"
         "minstepfrac=0.90\nmaxstepfrac=0.97\nminstepp=1.0e-8\nminstepd=1.0e-8\nusexzgap=1\ntweakgap=0\n"
         "affine=0\nprintlevel=0\nperturbobj=0\nfastmode=0\n";
  const std::string command = "cd '" + file.parent_path().string() +
                              "' && OMP_NUM_THREADS=1 " DEXCHECK_CSDP " '" + file.string() + "' '" +
                              file.string() + ".sol' > /dev/null 2>&1";
  const int status = std::system(command.c_str());
  return status == -1 ? -1 : WEXITSTATUS(status);
}

}  // namespace dexcheck::testing
