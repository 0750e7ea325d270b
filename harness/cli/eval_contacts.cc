#include "harness/cli/eval_contacts.h"

#include <memory>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "controller/contact/contact_geometry.h"
#include "controller/contact/grasp_map.h"
#include "controller/contact/shapes.h"
#include "controller/control/grasp_controller.h"
#include "controller/grasp/force_closure.h"
#include "controller/object/euler_zyz.h"
#include "harness/cli/json_matrix.h"

namespace dexcheck::cli {

namespace {

// A contact point may be off the surface by the digits that a person writes, m.
constexpr double kOnSurface = 1e-6;

/// kappa of a fingertip that touches the object's surface at a point: the fingertip's point whose normal is
/// opposite.
ContactCoordinates CalcKappaAt(const Surface& fingertip, const Surface& object, const SurfacePoint& alpha_o,
                               const Matrix3d& R_OF) {
  ContactCoordinates kappa;
  kappa.alpha_o = alpha_o;
  const SurfaceGeometry on_object = object.Evaluate(alpha_o);
  kappa.alpha_f = fingertip.Project(-R_OF.transpose() * on_object.R.col(2)).alpha;
  // x_cf = R_psi's first column in Sigma_co: [cos psi, -sin psi].
  const Vector3d x_cf = R_OF * fingertip.Evaluate(kappa.alpha_f).R.col(0);
  kappa.psi = std::atan2(-on_object.R.col(1).dot(x_cf), on_object.R.col(0).dot(x_cf));
  return kappa;
}

ContactCoordinates ReadKappa(const ContactState& contacts, Eigen::Index i) {
  ContactCoordinates kappa;
  kappa.alpha_f = {contacts.kappa(i, 0), contacts.kappa(i, 1), 0};
  kappa.alpha_o = {contacts.kappa(i, 2), contacts.kappa(i, 3), 0};
  kappa.psi = contacts.kappa(i, 4);
  return kappa;
}

Json DescribeContact(const Contact& contact, const ContactCoordinates& kappa, const std::string& finger) {
  const ContactGeometry& geometry = contact.geometry;
  return {{"finger", finger},
          {"kappa", ToList(kappa.CalcVector())},
          {"charts", {kappa.alpha_f.chart, kappa.alpha_o.chart}},
          {"kappa_dot", ToList(contact.kappa_dot)},
          {"M_f", ToRows(geometry.fingertip.M)},
          {"K_f", ToRows(geometry.fingertip.K)},
          {"T_f", ToList(geometry.fingertip.T.transpose())},
          {"M_o", ToRows(geometry.object.M)},
          {"K_o", ToRows(geometry.object.K)},
          {"T_o", ToList(geometry.object.T.transpose())},
          {"R_psi", ToRows(geometry.R_psi)},
          {"g_f_cf", ToRows(geometry.g_f_cf.matrix())},
          {"g_o_cf", ToRows(geometry.g_o_cf.matrix())}};
}

/// Whether the grasp can resist every wrench (26), and how large a wrench in its weakest direction.
void AddForceClosure(const Matrix6Xd& G, double friction, Json* out) {
  const VectorXd mu = VectorXd::Constant(G.cols() / 3, friction);
  const ForceClosureOptions options;
  const ForceClosureResult result = CalcForceClosure(G, mu, options);
  const bool closed = result.status == ForceClosureStatus::kForceClosure;
  const bool open = result.status == ForceClosureStatus::kNotForceClosure;
  (*out)["force_closure"] = {{"mu", friction},
                             {"closed", closed ? Json(true)
                                        : open ? Json(false)
                                               : Json(nullptr)},
                             {"margin", result.margin},
                             {"margin_lower", result.margin_lower},
                             {"weakest_wrench", ToList(result.direction)},
                             {"length", options.length}};
}

}  // namespace

void AddContactTerms(const ModelTerms& terms, const State& state, Json* out) {
  const RobotModel& model = terms.model();
  const ContactState& contacts = *state.contacts;
  const std::unique_ptr<Surface> object = MakeSurface(model.object()->shape);
  Pose X_Bo = Pose::Identity();
  Vector6d V_o = Vector6d::Zero();
  if (state.object) {
    X_Bo = CalcObjectPose(state.object->X_o);
    V_o = CalcPInverse(state.object->X_o) * state.object->X_o_dot;
  }

  const auto count = static_cast<Eigen::Index>(contacts.fingertips.size());
  const int n = terms.size();
  std::vector<Contact> grasp;
  std::vector<ContactCoordinates> coordinates;
  MatrixXd J_B(3 * count, n);
  MatrixXd J_B_dot(3 * count, n);
  Matrix6Xd J_f(6, n);
  Matrix6Xd J_f_dot(6, n);
  Json list = Json::array();
  for (Eigen::Index i = 0; i < count; ++i) {
    const int frame = contacts.fingertips[static_cast<size_t>(i)];
    const Frame& tip = model.frames()[static_cast<size_t>(frame)];
    const Sphere fingertip(*tip.sphere_radius);
    const Pose X_OF = X_Bo.inverse() * terms.CalcFramePose(frame);
    const std::string entry =
        (contacts.points.rows() > 0 ? "contact_points[" : "kappa[") + std::to_string(i) + "]: ";
    terms.CalcFrameJacobian(frame, J_f, J_f_dot);
    ContactCoordinates kappa;
    Contact contact;
    try {
      kappa = contacts.points.rows() > 0
                  ? CalcKappaAt(fingertip, *object, object->Locate(contacts.points.row(i), kOnSurface),
                                X_OF.linear())
                  : ReadKappa(contacts, i);
      contact.geometry = CalcContactGeometry(fingertip, *object, kappa);
      if (state.object) {
        const Vector6d V_f = J_f * state.xi;
        contact.kappa_dot = CalcKappaDot(contact.geometry, CalcRelativeTwist(contact.geometry, V_f, V_o));
      }
    } catch (const std::invalid_argument& error) {
      throw InputError(entry + error.what());
    } catch (const SingularityError& error) {
      throw InputError(entry + error.what());
    }
    CalcContactJacobian(contact, J_f, J_B.middleRows(3 * i, 3));
    CalcContactJacobianDot(contact, J_f, J_f_dot, J_B_dot.middleRows(3 * i, 3));
    Json described = DescribeContact(contact, kappa, tip.name);
    if (state.object) {
      // How far the two bodies' contact points are apart at these poses: zero where kappa belongs to the
      // state.
      const Vector3d on_fingertip = X_OF * contact.geometry.g_f_cf.translation();
      described["distance"] = (on_fingertip - contact.geometry.g_o_cf.translation()).norm();
    }
    list.push_back(described);
    grasp.push_back(contact);
    coordinates.push_back(kappa);
  }
  Matrix6Xd G(6, 3 * count);
  Matrix6Xd G_dot(6, 3 * count);
  CalcGraspMap(grasp, G);
  CalcGraspMapDot(grasp, G_dot);
  (*out)["G"] = ToRows(G);
  (*out)["G_dot"] = ToRows(G_dot);
  (*out)["J_B"] = ToRows(J_B);
  (*out)["J_B_dot"] = ToRows(J_B_dot);
  (*out)["contacts"] = list;
  AddForceClosure(G, contacts.friction, out);
  if (state.law) AddLawTerms(terms, state, *object, coordinates, out);
}

namespace {

Json CalcLaw(const ModelTerms& terms, const State& state, const Surface& surface,
             std::span<const ContactCoordinates> kappa) {
  const RobotModel& model = terms.model();
  const LawState& wanted = *state.law;
  const ContactState& contacts = *state.contacts;
  const int count = static_cast<int>(contacts.fingertips.size());
  GraspTerms grasp(model, contacts.fingertips, model.object()->body, surface);
  grasp.SetState(terms, state.object->X_o, state.object->X_o_dot, kappa);
  DesiredMotion desired;
  desired.X_d = wanted.X_d;
  desired.X_d_dot = wanted.X_d_dot;
  desired.X_d_ddot = wanted.X_d_ddot;
  const Vector6d V_o_dot = CalcTrackingAcceleration({wanted.K_v, wanted.K_p}, grasp, desired);

  ComputedTorque law(model, count);
  law.SetDemand(terms, grasp, V_o_dot, wanted.sigma_prime);
  GraspForceProblem problem(count);
  problem.G = grasp.G();
  problem.F_o = law.F_o();
  problem.mu.setConstant(contacts.friction);
  problem.f_min.setConstant(wanted.f_min);
  problem.f_max.setConstant(wanted.f_max);
  GraspForceSolver solver(count);
  const GraspForceResult& force = solver.Solve(problem);
  RequireGraspForce(force);
  VectorXd F_N(grasp.num_forces());
  law.CalcInternalForce(force.f_c, F_N);
  const VectorXd tau = law.CalcTorque(grasp, F_N);

  Pseudoinverse J_B("J_B'", grasp.num_forces(), terms.size());
  J_B.Factor(grasp.J_B());
  Pseudoinverse G("G", 6, grasp.num_forces());
  G.Factor(grasp.G());
  const MatrixXd J_B_pinv = J_B.CalcMatrix();
  const ObjectTerms& object = grasp.coordinates();
  // (56): M_bar' J_B'^+ G^T P^-1 + J_B'^T G^+ M_o
  const MatrixXd A = terms.M() * J_B_pinv * grasp.G().transpose() * object.P_inv +
                     grasp.J_B().transpose() * G.CalcMatrix() * object.M_o;
  return {{"J_B_pinv", ToRows(J_B_pinv)},
          {"N", ToRows(J_B.CalcProjector())},
          {"xi_c", ToList(law.xi_c())},
          {"V_o_dot", ToList(V_o_dot)},
          {"xi_dot_d", ToList(law.xi_dot_d())},
          {"F_o", ToList(law.F_o())},
          {"F_N", ToList(F_N)},
          {"f_c", ToList(law.f_c())},
          {"tau", ToList(tau)},
          {"A", ToRows(A)}};
}

}  // namespace

void AddLawTerms(const ModelTerms& terms, const State& state, const Surface& surface,
                 std::span<const ContactCoordinates> kappa, Json* out) {
  try {
    (*out)["law"] = CalcLaw(terms, state, surface, kappa);
  } catch (const InputError&) {
    throw;
  } catch (const Error& error) {
    throw InputError(std::string("law: ") + error.what());
  }
}

}  // namespace dexcheck::cli
