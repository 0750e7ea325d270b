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
  if (options.engine_step > 0.0) model->opt.timestep = robot->opt.timestep = options.engine_step;
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

int DrawIndex(std::mt19937* random, int from, int to) {
  return std::uniform_int_distribution<>(from, to)(*random);
}

/// Returns the torque that a joint usually needs: ten times less at the wrist.
double UsualTorque(const mjModel& m, int joint) { return joint < m.nv - 3 ? 10.0 : 1.0; }

/// A fault of one column of a joint: "tau." or "q.".
RecordedFault ChangeColumn(const mjModel& m, const std::string& fault, const std::string& column, int joint,
                           double value, double (*change)(double number, double value)) {
  return {.fault = fault,
          .place = "joint " + JointName(m, joint),
          .value = value,
          .record = [=, name = column + JointName(m, joint)](RecordedTable* table) {
            for (double& number : table->Get(name)) number = change(number, value);
          }};
}
double Add(double number, double value) { return number + value; }
double Multiply(double number, double value) { return number * value; }

/// More of a constant of a joint.
template <mjtNum* mjModel::*constant>
RecordedFault ChangeJoint(const mjModel& m, const char* fault, double largest, std::mt19937* random) {
  const int joint = DrawIndex(random, 0, m.nv - 1);
  const double value = UsualTorque(m, joint) * Draw(random, 0.05, largest);
  return {fault, "joint " + JointName(m, joint), value, [=](mjModel* r) { (r->*constant)[joint] = value; }};
}

RecordedFault ExchangeTorques(const mjModel& m, std::mt19937* random) {
  const int joint = DrawIndex(random, 0, m.nv - 2), other = DrawIndex(random, joint + 1, m.nv - 1);
  const std::string a = JointName(m, joint), b = JointName(m, other);
  return {.fault = "torque exchanged with that of " + b,
          .place = "joint " + a,
          .value = kUnknown,
          .record = [=](RecordedTable* table) { std::swap(table->Get("tau." + a), table->Get("tau." + b)); }};
}

RecordedFault DelayTorques(const mjModel&, std::mt19937* random) {
  const int rows = DrawIndex(random, 4, 15);
  return {.fault = "delay of the torques",
          .place = "all joints",
          .value = 0.002 * rows,
          .record = [=](RecordedTable* table) {
            for (size_t i = 0; i < table->names.size(); ++i) {
              std::vector<double>& tau = table->columns[i];
              if (!table->names[i].starts_with("tau.")) continue;
              std::copy_backward(tau.begin(), tau.end() - rows, tau.end());
              std::fill_n(tau.begin(), rows, tau.front());
            }
          }};
}

RecordedFault ReversePositions(const mjModel& m, std::mt19937* random) {
  const int joint = DrawIndex(random, 1, m.nv - 2);
  RecordedFault fault = ChangeColumn(m, "position gain", "q.", joint, -1.0, Multiply);
  fault.record = [name = JointName(m, joint)](RecordedTable* table) {
    for (const std::string& column : table->names)
      if (column.ends_with("." + name) && !column.starts_with("tau"))
        for (double& q : table->Get(column)) q *= -1.0;
  };
  return fault;
}

RecordedFault ChangeMass(const mjModel& m, std::mt19937* random) {
  const int joint = DrawIndex(random, 1, m.nv - 2), body = m.jnt_bodyid[joint];
  const double factor = Draw(random, 1.1, 1.5);
  return {"mass", "link " + LinkName(m, joint), factor * m.body_mass[body], [=](mjModel* r) {
            r->body_mass[body] *= factor;
            for (int k = 0; k < 3; ++k) r->body_inertia[3 * body + k] *= factor;
          }};
}

RecordedFault MoveCenter(const mjModel& m, std::mt19937* random) {
  const int joint = DrawIndex(random, 1, m.nv - 1), entry = 3 * m.jnt_bodyid[joint] + DrawIndex(random, 0, 2);
  const double value = Draw(random, 0.02, 0.06);
  return {"centre of mass", "link " + LinkName(m, joint), value,
          [=](mjModel* r) { r->body_ipos[entry] += value; }};
}

/// A point mass at the last link. The two are one body: inertia of both about the common centre.
RecordedFault AttachMass(const mjModel& m, std::mt19937* random) {
  const int body = m.jnt_bodyid[m.nv - 1];
  const double mass = Draw(random, 0.3, 3.0);
  const double x = Draw(random, -0.05, 0.05), y = Draw(random, -0.05, 0.05), z = Draw(random, 0.1, 0.2);
  return {"payload", "link " + LinkName(m, m.nv - 1), mass, [=](mjModel* r) {
            Eigen::Map<Vector3d> c(r->body_ipos + 3 * body), moments(r->body_inertia + 3 * body);
            double* const quat = r->body_iquat + 4 * body;
            const double m0 = r->body_mass[body], all = m0 + mass;
            const Vector3d p(x, y, z), d = p - c;
            const Matrix3d R = Eigen::Quaterniond(quat[0], quat[1], quat[2], quat[3]).toRotationMatrix();
            // The inertia of two points d apart has the reduced mass.
            const Matrix3d I = R * moments.asDiagonal() * R.transpose() +
                               m0 * mass / all * (d.squaredNorm() * Matrix3d::Identity() - d * d.transpose());
            const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(I);
            Matrix3d axes = eigen.eigenvectors();
            if (axes.determinant() < 0.0) axes.col(0) *= -1.0;
            const Eigen::Quaterniond q(axes);
            r->body_mass[body] = all;
            c += mass / all * d;
            moments = eigen.eigenvalues();
            quat[0] = q.w(), quat[1] = q.x(), quat[2] = q.y(), quat[3] = q.z();
          }};
}

RecordedFault TurnGravity(const mjModel&, std::mt19937* random) {
  const double angle = Draw(random, 0.05, 1.5), direction = Draw(random, 0.0, 2.0 * kPi);
  return {"gravity", "world", kUnknown, [=](mjModel* r) {
            const double g = -r->opt.gravity[2];
            r->opt.gravity[0] = g * std::sin(angle) * std::cos(direction);
            r->opt.gravity[1] = g * std::sin(angle) * std::sin(direction);
            r->opt.gravity[2] = -g * std::cos(angle);
          }};
}

RecordedFault PushLink(const mjModel& m, std::mt19937* random) {
  const int joint = DrawIndex(random, 2, m.nv - 1), body = m.jnt_bodyid[joint];
  const double from = Draw(random, 3.0, 14.0), to = from + Draw(random, 0.5, 3.0);
  Vector3d force(Draw(random, -1.0, 1.0), Draw(random, -1.0, 1.0), Draw(random, -1.0, 1.0));
  force *= Draw(random, 5.0, 30.0) / force.norm();
  return {.fault = "force",
          .place = "link " + LinkName(m, joint),
          .value = force.norm(),
          .act = [=](double t, const mjModel&, mjData* d) {
            if (t < from || t > to) return;
            for (int k = 0; k < 3; ++k) d->xfrc_applied[6 * body + k] = force[k];
          }};
}

using Kind = RecordedFault (*)(const mjModel&, std::mt19937*);
constexpr Kind kKinds[] = {
    [](const mjModel& m, std::mt19937* random) {
      return ChangeJoint<&mjModel::dof_frictionloss>(m, "dry friction", 0.3, random);
    },
    [](const mjModel& m, std::mt19937* random) {
      return ChangeJoint<&mjModel::dof_damping>(m, "viscous friction", 0.5, random);
    },
    [](const mjModel& m, std::mt19937* random) {
      return ChangeJoint<&mjModel::dof_armature>(m, "armature", 0.2, random);
    },
    [](const mjModel& m, std::mt19937* random) {
      const int joint = DrawIndex(random, 0, m.nv - 1);
      const double value = DrawSign(random) * UsualTorque(m, joint) * Draw(random, 0.05, 0.3);
      return ChangeColumn(m, "torque offset", "tau.", joint, value, Add);
    },
    [](const mjModel& m, std::mt19937* random) {
      const int joint = DrawIndex(random, 0, m.nv - 1);
      return ChangeColumn(m, "torque gain", "tau.", joint, Draw(random, 0.7, 0.95), Multiply);
    },
    [](const mjModel& m, std::mt19937* random) {
      return ChangeColumn(m, "torque gain", "tau.", DrawIndex(random, 0, m.nv - 1), -1.0, Multiply);
    },
    ExchangeTorques,
    DelayTorques,
    [](const mjModel& m, std::mt19937* random) {
      const int joint = DrawIndex(random, 1, m.nv - 1);
      const double value = DrawSign(random) * Draw(random, 0.02, 0.1);
      return ChangeColumn(m, "position offset", "q.", joint, value, Add);
    },
    ReversePositions,
    ChangeMass,
    MoveCenter,
    AttachMass,
    TurnGravity,
    PushLink,
};

}  // namespace

int CountRecordedFaultKinds() { return static_cast<int>(std::size(kKinds)); }

int PayloadKind() { return CountRecordedFaultKinds() - 3; }

RecordedFault DrawRecordedFault(const std::string& mjcf, int kind, std::mt19937* random) {
  static std::map<std::string, MjModelPtr> models;
  MjModelPtr& model = models[mjcf];
  if (!model) model = LoadMjcf(std::filesystem::path(SourcePath("/" + mjcf)));
  return kKinds[kind](*model, random);
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
