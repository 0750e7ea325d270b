#include "tests/harness/recordings/recorded_robot.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

#include "harness/engine/mujoco_release.h"
#include "harness/recordings/column_names.h"
#include "tests/common/paths.h"

namespace dexcheck::testing {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

std::string JointName(const mjModel& m, int joint) { return mj_id2name(&m, mjOBJ_JOINT, joint); }
std::string LinkName(const mjModel& m, int joint) { return mj_id2name(&m, mjOBJ_BODY, m.jnt_bodyid[joint]); }

double Draw(std::mt19937* random, double from, double to) {
  return std::uniform_real_distribution<>(from, to)(*random);
}
double DrawSign(std::mt19937* random) { return std::bernoulli_distribution()(*random) ? 1.0 : -1.0; }

/// A joint's motion: a sum of sines about a posture.
struct Sines {
  double centre = 0.0;
  double amplitude[3], frequency[3], phase[3];
  void Calc(double t, double* q, double* qd, double* qdd) const {
    *q = centre;
    *qd = *qdd = 0.0;
    for (int k = 0; k < 3; ++k) {
      const double w = 2.0 * kPi * frequency[k];
      *q += amplitude[k] * std::sin(w * t + phase[k]);
      *qd += amplitude[k] * w * std::cos(w * t + phase[k]);
      *qdd -= amplitude[k] * w * w * std::sin(w * t + phase[k]);
    }
  }
};

}  // namespace

std::vector<double>& RecordedTable::Get(const std::string& name) {
  return columns[static_cast<size_t>(std::find(names.begin(), names.end(), name) - names.begin())];
}

RecordedTable RecordRobot(const std::string& mjcf, const std::vector<RecordedFault>& faults,
                          const RecordingOptions& options, std::mt19937* random) {
  // The controller's model is right; only the simulated robot has the faults.
  const MjModelPtr model = LoadMjcf(std::filesystem::path(SourcePath("/" + mjcf)));
  MjModelPtr robot = LoadMjcf(std::filesystem::path(SourcePath("/" + mjcf)));
  for (const RecordedFault& one : faults)
    if (one.change) one.change(robot.get());
  const MjDataPtr own(mj_makeData(model.get()));
  const MjDataPtr data(mj_makeData(robot.get()));
  const int n = model->nv;
  std::vector<Sines> motion(static_cast<size_t>(n));
  for (int i = 0; i < n; ++i) {
    Sines& one = motion[static_cast<size_t>(i)];
    const double low = model->jnt_range[2 * i], high = model->jnt_range[2 * i + 1];
    one.centre = 0.5 * (low + high);
    const double room = std::min(0.4 * (high - low), 1.0);
    for (int k = 0; k < 3; ++k) {
      one.amplitude[k] = room / 3.0 * Draw(random, 0.5, 1.0);
      one.frequency[k] = Draw(random, 0.1, 0.2) * (k + 1);
      one.phase[k] = Draw(random, 0.0, 2.0 * kPi);
    }
  }
  const auto calc = [&](double t, VectorXd* q, VectorXd* qd, VectorXd* qdd) {
    for (VectorXd* const each : {q, qd, qdd}) each->resize(n);
    if (options.motion) return options.motion(t, q, qd, qdd);
    for (int i = 0; i < n; ++i) motion[static_cast<size_t>(i)].Calc(t, &(*q)[i], &(*qd)[i], &(*qdd)[i]);
  };
  VectorXd q, qd, qdd;
  calc(0.0, &q, &qd, &qdd);
  mju_copy(data->qpos, q.data(), n);
  mju_copy(data->qvel, qd.data(), n);
  RecordedTable table;
  table.names.push_back("time");
  for (int i = 0; i < n; ++i) table.names.push_back("q." + JointName(*model, i));
  if (options.has_velocities)
    for (int i = 0; i < n; ++i) table.names.push_back("qd." + JointName(*model, i));
  for (int i = 0; i < n; ++i) table.names.push_back("tau." + JointName(*model, i));
  table.columns.resize(table.names.size());
  const double dt = model->opt.timestep;
  const int every = std::max(1, static_cast<int>(std::lround(options.step / dt)));
  const double count = options.encoder_bits > 0 ? 2.0 * kPi / std::pow(2.0, options.encoder_bits) : 0.0;
  VectorXd torque(n);
  MatrixXd M(n, n);
  for (int step = 0; step * dt < options.duration; ++step) {
    const double t = step * dt;
    mju_copy(own->qpos, data->qpos, n);
    mju_copy(own->qvel, data->qvel, n);
    mj_forward(model.get(), own.get());
    ExpandMass(*model, *own, M.data());
    VectorXd wanted(n);
    calc(t, &q, &qd, &qdd);
    constexpr double kStiffness = 100.0, kDamping = 20.0;
    for (int i = 0; i < n; ++i)
      wanted[i] = qdd[i] + kStiffness * (q[i] - data->qpos[i]) + kDamping * (qd[i] - data->qvel[i]);
    torque = M * wanted;
    for (int i = 0; i < n; ++i) torque[i] += own->qfrc_bias[i] - own->qfrc_passive[i];
    if (step % every == 0) {
      size_t column = 0;
      table.columns[column++].push_back(t);
      for (int i = 0; i < n; ++i)
        table.columns[column++].push_back(count > 0.0 ? count * std::round(data->qpos[i] / count)
                                                      : data->qpos[i]);
      if (options.has_velocities)
        for (int i = 0; i < n; ++i)
          table.columns[column++].push_back(data->qvel[i] +
                                            std::normal_distribution<>(0.0, options.velocity_noise)(*random));
      for (int i = 0; i < n; ++i) table.columns[column++].push_back(torque[i]);
    }
    mju_copy(data->qfrc_applied, torque.data(), n);
    mju_zero(data->xfrc_applied, 6 * robot->nbody);
    for (const RecordedFault& one : faults)
      if (one.act) one.act(t, *robot, data.get());
    mj_step(robot.get(), data.get());
  }
  for (const RecordedFault& one : faults)
    if (one.record) one.record(&table);
  for (int i = 0; i < n; ++i) {
    std::vector<double>& tau = table.Get("tau." + JointName(*model, i));
    const double usual =
        Eigen::Map<const VectorXd>(tau.data(), static_cast<Eigen::Index>(tau.size())).norm() /
        std::sqrt(static_cast<double>(tau.size()));
    if (options.torque_noise > 0.0)
      for (double& value : tau)
        value += std::normal_distribution<>(0.0, options.torque_noise * usual)(*random);
  }
  return table;
}

namespace {

using Kind = std::function<RecordedFault(const mjModel&, std::mt19937*)>;

int DrawJoint(const mjModel& m, std::mt19937* random) {
  return std::uniform_int_distribution<>(0, m.nv - 1)(*random);
}

/// Of torques that the joint usually needs.
double UsualTorque(const mjModel& m, int joint) {
  // Twelve times less at the wrist.
  return joint < m.nv - 3 ? 10.0 : 1.0;
}

const std::vector<Kind>& ListKinds() {
  static const std::vector<Kind> kKinds = {
      [](const mjModel& m, std::mt19937* random) {
        const int joint = DrawJoint(m, random);
        const double value = UsualTorque(m, joint) * Draw(random, 0.05, 0.3);
        return RecordedFault{"dry friction", "joint " + JointName(m, joint), value,
                             [=](mjModel* r) { r->dof_frictionloss[joint] = value; }};
      },
      [](const mjModel& m, std::mt19937* random) {
        const int joint = DrawJoint(m, random);
        const double value = UsualTorque(m, joint) * Draw(random, 0.05, 0.5);
        return RecordedFault{"viscous friction", "joint " + JointName(m, joint), value,
                             [=](mjModel* r) { r->dof_damping[joint] = value; }};
      },
      [](const mjModel& m, std::mt19937* random) {
        const int joint = DrawJoint(m, random);
        const double value = UsualTorque(m, joint) * Draw(random, 0.05, 0.2);
        return RecordedFault{"armature", "joint " + JointName(m, joint), value,
                             [=](mjModel* r) { r->dof_armature[joint] = value; }};
      },
      [](const mjModel& m, std::mt19937* random) {
        const int joint = DrawJoint(m, random);
        const double value = DrawSign(random) * UsualTorque(m, joint) * Draw(random, 0.05, 0.3);
        return RecordedFault{
            "torque offset", "joint " + JointName(m, joint), value, {}, {}, [=](RecordedTable* table) {
              for (double& tau : table->Get("tau." + JointName(m, joint))) tau += value;
            }};
      },
      [](const mjModel& m, std::mt19937* random) {
        const int joint = DrawJoint(m, random);
        const double value = Draw(random, 0.7, 0.95);
        return RecordedFault{
            "torque gain", "joint " + JointName(m, joint), value, {}, {}, [=](RecordedTable* table) {
              for (double& tau : table->Get("tau." + JointName(m, joint))) tau *= value;
            }};
      },
      [](const mjModel& m, std::mt19937* random) {
        const int joint = DrawJoint(m, random);
        return RecordedFault{
            "torque gain", "joint " + JointName(m, joint), -1.0, {}, {}, [=](RecordedTable* table) {
              for (double& tau : table->Get("tau." + JointName(m, joint))) tau *= -1.0;
            }};
      },
      [](const mjModel& m, std::mt19937* random) {
        const int joint = std::uniform_int_distribution<>(0, m.nv - 2)(*random);
        const int other = std::uniform_int_distribution<>(joint + 1, m.nv - 1)(*random);
        return RecordedFault{"torque exchanged with that of " + JointName(m, other),
                             "joint " + JointName(m, joint),
                             kUnknown,
                             {},
                             {},
                             [=](RecordedTable* table) {
                               std::swap(table->Get("tau." + JointName(m, joint)),
                                         table->Get("tau." + JointName(m, other)));
                             }};
      },
      [](const mjModel&, std::mt19937* random) {
        const int rows = std::uniform_int_distribution<>(4, 15)(*random);
        return RecordedFault{
            "delay of the torques", "all joints", 0.002 * rows, {}, {}, [=](RecordedTable* table) {
              for (size_t i = 0; i < table->names.size(); ++i)
                if (table->names[i].starts_with("tau.")) {
                  std::vector<double>& tau = table->columns[i];
                  for (size_t row = tau.size(); row-- > 0;)
                    tau[row] = tau[row >= static_cast<size_t>(rows) ? row - static_cast<size_t>(rows) : 0];
                }
            }};
      },
      [](const mjModel& m, std::mt19937* random) {
        const int joint = std::uniform_int_distribution<>(1, m.nv - 1)(*random);
        const double value = DrawSign(random) * Draw(random, 0.02, 0.1);
        return RecordedFault{
            "position offset", "joint " + JointName(m, joint), value, {}, {}, [=](RecordedTable* table) {
              for (double& q : table->Get("q." + JointName(m, joint))) q += value;
            }};
      },
      [](const mjModel& m, std::mt19937* random) {
        const int joint = std::uniform_int_distribution<>(1, m.nv - 2)(*random);
        return RecordedFault{
            "position gain", "joint " + JointName(m, joint), -1.0, {}, {}, [=](RecordedTable* table) {
              for (const std::string& name : table->names)
                if (name.ends_with("." + JointName(m, joint)) && !name.starts_with("tau"))
                  for (double& q : table->Get(name)) q *= -1.0;
            }};
      },
      [](const mjModel& m, std::mt19937* random) {
        const int joint = std::uniform_int_distribution<>(1, m.nv - 2)(*random);
        const int body = m.jnt_bodyid[joint];
        const double factor = Draw(random, 1.1, 1.5);
        return RecordedFault{"mass", "link " + LinkName(m, joint), factor * m.body_mass[body],
                             [=](mjModel* r) {
                               r->body_mass[body] *= factor;
                               for (int k = 0; k < 3; ++k) r->body_inertia[3 * body + k] *= factor;
                             }};
      },
      [](const mjModel& m, std::mt19937* random) {
        const int joint = std::uniform_int_distribution<>(1, m.nv - 1)(*random);
        const int body = m.jnt_bodyid[joint], axis = std::uniform_int_distribution<>(0, 2)(*random);
        const double value = Draw(random, 0.02, 0.06);
        return RecordedFault{"centre of mass", "link " + LinkName(m, joint), value,
                             [=](mjModel* r) { r->body_ipos[3 * body + axis] += value; }};
      },
      [](const mjModel& m, std::mt19937* random) {
        const int joint = m.nv - 1;
        const int body = m.jnt_bodyid[joint];
        const double mass = Draw(random, 0.3, 3.0);
        const double place[3] = {Draw(random, -0.05, 0.05), Draw(random, -0.05, 0.05),
                                 Draw(random, 0.1, 0.2)};
        const double x = place[0], y = place[1], z = place[2];
        return RecordedFault{
            "payload", "link " + LinkName(m, joint), mass, [=](mjModel* r) {
              // The link and a point mass, as one body: inertia of both about the common centre.
              double* c = r->body_ipos + 3 * body;
              const double m0 = r->body_mass[body], all = m0 + mass;
              const Vector3d c0(c[0], c[1], c[2]), p(x, y, z), centre = (m0 * c0 + mass * p) / all;
              Eigen::Quaterniond R(r->body_iquat[4 * body], r->body_iquat[4 * body + 1],
                                   r->body_iquat[4 * body + 2], r->body_iquat[4 * body + 3]);
              Matrix3d I = R.toRotationMatrix() *
                           Vector3d(r->body_inertia[3 * body], r->body_inertia[3 * body + 1],
                                    r->body_inertia[3 * body + 2])
                               .asDiagonal() *
                           R.toRotationMatrix().transpose();
              const auto add = [&](double weight, const Vector3d& d) {
                I += weight * (d.squaredNorm() * Matrix3d::Identity() - d * d.transpose());
              };
              add(m0, c0 - centre);
              add(mass, p - centre);
              const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(I);
              Matrix3d axes = eigen.eigenvectors();
              if (axes.determinant() < 0.0) axes.col(0) *= -1.0;
              const Eigen::Quaterniond q(axes);
              r->body_mass[body] = all;
              for (int k = 0; k < 3; ++k)
                c[k] = centre[k], r->body_inertia[3 * body + k] = eigen.eigenvalues()[k];
              r->body_iquat[4 * body] = q.w(), r->body_iquat[4 * body + 1] = q.x(),
                                r->body_iquat[4 * body + 2] = q.y(), r->body_iquat[4 * body + 3] = q.z();
            }};
      },
      [](const mjModel&, std::mt19937* random) {
        const double angle = Draw(random, 0.05, 1.5), direction = Draw(random, 0.0, 2.0 * kPi);
        return RecordedFault{"gravity", "world", kUnknown, [=](mjModel* r) {
                               const double g = -r->opt.gravity[2];
                               r->opt.gravity[0] = g * std::sin(angle) * std::cos(direction);
                               r->opt.gravity[1] = g * std::sin(angle) * std::sin(direction);
                               r->opt.gravity[2] = -g * std::cos(angle);
                             }};
      },
      [](const mjModel& m, std::mt19937* random) {
        const int joint = std::uniform_int_distribution<>(2, m.nv - 1)(*random);
        const int body = m.jnt_bodyid[joint];
        const double from = Draw(random, 3.0, 14.0), to = from + Draw(random, 0.5, 3.0);
        Vector3d force(Draw(random, -1.0, 1.0), Draw(random, -1.0, 1.0), Draw(random, -1.0, 1.0));
        force *= Draw(random, 5.0, 30.0) / force.norm();
        return RecordedFault{"force",
                             "link " + LinkName(m, joint),
                             force.norm(),
                             {},
                             [=](double t, const mjModel&, mjData* d) {
                               if (t < from || t > to) return;
                               for (int k = 0; k < 3; ++k) d->xfrc_applied[6 * body + k] = force[k];
                             }};
      },
  };
  return kKinds;
}

}  // namespace

int CountRecordedFaultKinds() { return static_cast<int>(ListKinds().size()); }

int PayloadKind() { return CountRecordedFaultKinds() - 3; }

RecordedFault DrawRecordedFault(const std::string& mjcf, int kind, std::mt19937* random) {
  static std::map<std::string, MjModelPtr> models;
  MjModelPtr& model = models[mjcf];
  if (!model) model = LoadMjcf(std::filesystem::path(SourcePath("/" + mjcf)));
  return ListKinds()[static_cast<size_t>(kind)](*model, random);
}

void WriteCsv(const RecordedTable& table, const std::filesystem::path& path) {
  std::ofstream file(path);
  file.precision(12);
  for (size_t i = 0; i < table.names.size(); ++i) file << (i == 0 ? "" : ",") << table.names[i];
  for (size_t row = 0; row < table.rows(); ++row) {
    for (size_t i = 0; i < table.columns.size(); ++i) file << (i == 0 ? '\n' : ',') << table.columns[i][row];
  }
  file << "\n";
}

Recording ToRecording(const RobotModel& model, const RecordedTable& table) {
  Recording recording;
  recording.name = "drawn";
  recording.channels = GuessChannels(model, table.names);
  recording.reader = std::make_unique<TableReader>("drawn", "table", table.names, table.columns);
  recording.reopen = [&] { return ToRecording(model, table); };
  return recording;
}

}  // namespace dexcheck::testing
