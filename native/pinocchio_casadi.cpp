// Pinocchio's algorithms on casadi::SX, behind a plain C interface.
//
// Python reads the numbers of a pin.Model and passes them to pathwalker_build(), which builds the
// same model with symbolic inertias and placements, runs Pinocchio on it and returns serialised
// casadi::Functions, one per line.  Only text crosses the border, so neither Python nor URDF headers
// are needed.

#include <pinocchio/autodiff/casadi.hpp>

#include <casadi/config.h>
#include <pinocchio/algorithm/center-of-mass.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/multibody.hpp>

#include <exception>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using casadi::Function;
using casadi::SX;
using casadi::SXVector;

// Pinocchio's default collection would triple the compile time and memory for joints unused here.
template <typename S, int O>
struct AxisAlignedJoints {
  using Scalar = S;
  static constexpr int Options = O;
  using JointModelVariant = boost::variant<
      pinocchio::JointModelRevoluteTpl<S, O, 0>, pinocchio::JointModelRevoluteTpl<S, O, 1>,
      pinocchio::JointModelRevoluteTpl<S, O, 2>, pinocchio::JointModelPrismaticTpl<S, O, 0>,
      pinocchio::JointModelPrismaticTpl<S, O, 1>, pinocchio::JointModelPrismaticTpl<S, O, 2>>;
  using JointDataVariant = boost::variant<
      pinocchio::JointDataRevoluteTpl<S, O, 0>, pinocchio::JointDataRevoluteTpl<S, O, 1>,
      pinocchio::JointDataRevoluteTpl<S, O, 2>, pinocchio::JointDataPrismaticTpl<S, O, 0>,
      pinocchio::JointDataPrismaticTpl<S, O, 1>, pinocchio::JointDataPrismaticTpl<S, O, 2>>;
};

using Model = pinocchio::ModelTpl<SX, 0, AxisAlignedJoints>;
using Data = pinocchio::DataTpl<SX, 0, AxisAlignedJoints>;
using Joint = pinocchio::JointModelTpl<SX, 0, AxisAlignedJoints>;
using SE3 = Model::SE3;
using Vector3 = SE3::Vector3;
using Matrix3 = SE3::Matrix3;
using VectorX = Model::VectorXs;

constexpr auto kWorldAxes = pinocchio::LOCAL_WORLD_ALIGNED;
constexpr int kAxes[] = {0, 2};  // the model is planar: x forward, z up

// Entries per joint and per point in theta; the order is that of parameters.py.
constexpr int kJointEntries = 13;
constexpr int kPointEntries = 3;

Joint joint_of_type(int type) {
  switch (type) {
    case 0: return pinocchio::JointModelRevoluteTpl<SX, 0, 0>();
    case 1: return pinocchio::JointModelRevoluteTpl<SX, 0, 1>();
    case 2: return pinocchio::JointModelRevoluteTpl<SX, 0, 2>();
    case 3: return pinocchio::JointModelPrismaticTpl<SX, 0, 0>();
    case 4: return pinocchio::JointModelPrismaticTpl<SX, 0, 1>();
    case 5: return pinocchio::JointModelPrismaticTpl<SX, 0, 2>();
    default: throw std::invalid_argument("unknown joint type " + std::to_string(type));
  }
}

Vector3 vector3(const SX& theta, int at) { return {theta(at), theta(at + 1), theta(at + 2)}; }

Model::Inertia inertia(const SX& theta, int at) {
  // Pinocchio keeps a symmetric matrix as xx, xy, yy, xz, yz, zz.
  const pinocchio::Symmetric3Tpl<SX, 0> about_com(theta(at + 4), theta(at + 5), theta(at + 6),
                                                  theta(at + 7), theta(at + 8), theta(at + 9));
  return {theta(at), vector3(theta, at + 1), about_com};
}

Matrix3 rotation(const double* row_major) {
  Matrix3 result;
  for (int i = 0; i < 9; ++i) result(i / 3, i % 3) = SX(row_major[i]);
  return result;
}

VectorX to_eigen(const SX& vector) {
  VectorX result(vector.numel());
  for (casadi_int i = 0; i < vector.numel(); ++i) result[i] = vector(i);
  return result;
}

template <typename Derived>
SX to_casadi(const Eigen::MatrixBase<Derived>& matrix) {
  SX result(matrix.rows(), matrix.cols());
  for (Eigen::Index i = 0; i < matrix.rows(); ++i)
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) result(i, j) = matrix(i, j);
  return result;
}

// The x and z entries of one 3-vector per frame, stacked.
template <typename Entry>
SX in_plane(const std::vector<pinocchio::FrameIndex>& frames, Entry entry) {
  SXVector rows;
  for (const auto frame : frames) {
    const Vector3 value = entry(frame);
    for (const int axis : kAxes) rows.push_back(value[axis]);
  }
  return SX::vertcat(rows);
}

std::vector<Function> build(int n_joints, const int* parents, const int* types,
                            const double* rotations, int n_points, const int* point_joints,
                            const double* gravity) {
  const SX theta = SX::sym("theta", n_joints * kJointEntries + n_points * kPointEntries);
  Model model;
  model.gravity.linear(Vector3(SX(gravity[0]), SX(gravity[1]), SX(gravity[2])));
  for (int i = 0; i < n_joints; ++i) {
    const int at = i * kJointEntries;
    const SE3 placement(rotation(rotations + 9 * i), vector3(theta, at));
    const auto id = model.addJoint(parents[i], joint_of_type(types[i]), placement,
                                   "joint" + std::to_string(i));
    // Appending bodies or frames merges them with a massless body: (m c) / max(m, eps) in every graph.
    model.inertias[id] = inertia(theta, at + 3);
  }
  std::vector<pinocchio::FrameIndex> frames;
  for (int i = 0; i < n_points; ++i) {
    const SE3 placement(Matrix3::Identity(),
                        vector3(theta, n_joints * kJointEntries + i * kPointEntries));
    frames.push_back(model.addFrame(Model::Frame("point" + std::to_string(i), point_joints[i], 0,
                                                 placement, pinocchio::OP_FRAME),
                                    /*append_inertia=*/false));
  }

  const SX q = SX::sym("q", model.nq), v = SX::sym("v", model.nv), vdot = SX::sym("vdot", model.nv);
  const VectorX q_ = to_eigen(q), v_ = to_eigen(v), vdot_ = to_eigen(vdot);
  const auto function = [](const char* name, const SXVector& in,
                           const std::vector<std::string>& names, const SX& out) {
    return Function(name, in, {out}, names, {name});
  };
  std::vector<Function> result;

  Data data(model);
  const SX tau = to_casadi(pinocchio::rnea(model, data, q_, v_, vdot_));
  result.push_back(
      function("inverse_dynamics", {q, v, vdot, theta}, {"q", "v", "vdot", "theta"}, tau));

  data = Data(model);
  const SX mass = SX::triu2symm(SX::triu(to_casadi(pinocchio::crba(model, data, q_))));
  result.push_back(function("mass_matrix", {q, theta}, {"q", "theta"}, mass));

  data = Data(model);
  const SX bias = to_casadi(pinocchio::nonLinearEffects(model, data, q_, v_));
  result.push_back(function("bias", {q, v, theta}, {"q", "v", "theta"}, bias));

  data = Data(model);
  pinocchio::forwardKinematics(model, data, q_, v_, vdot_);
  pinocchio::updateFramePlacements(model, data);
  const SX positions = in_plane(
      frames, [&](auto frame) -> Vector3 { return data.oMf[frame].translation(); });
  const SX velocities = in_plane(frames, [&](auto frame) -> Vector3 {
    return pinocchio::getFrameVelocity(model, data, frame, kWorldAxes).linear();
  });
  const SX accelerations = in_plane(frames, [&](auto frame) -> Vector3 {
    return pinocchio::getFrameClassicalAcceleration(model, data, frame, kWorldAxes).linear();
  });
  result.push_back(function("point_positions", {q, theta}, {"q", "theta"}, positions));
  result.push_back(function("point_velocities", {q, v, theta}, {"q", "v", "theta"}, velocities));
  result.push_back(function("point_accelerations", {q, v, vdot, theta}, {"q", "v", "vdot", "theta"},
                            accelerations));

  data = Data(model);
  pinocchio::computeJointJacobians(model, data, q_);
  pinocchio::updateFramePlacements(model, data);
  SXVector rows;
  for (const auto frame : frames) {
    Data::Matrix6x jacobian(6, model.nv);
    jacobian.setZero();
    pinocchio::getFrameJacobian(model, data, frame, kWorldAxes, jacobian);
    for (const int axis : kAxes) rows.push_back(to_casadi(jacobian.row(axis)));
  }
  const SX jacobian = rows.empty() ? SX(0, model.nv) : SX::vertcat(rows);
  result.push_back(function("point_jacobian", {q, theta}, {"q", "theta"}, jacobian));

  data = Data(model);
  const SX com = to_casadi(pinocchio::centerOfMass(model, data, q_));
  result.push_back(function("centre_of_mass", {q, theta}, {"q", "theta"}, com));
  return result;
}

thread_local std::string answer;

}  // namespace

#define EXPORT extern "C" __attribute__((visibility("default")))

// Versions of Pinocchio and CasADi this file was compiled against, separated by a space.
EXPORT const char* pathwalker_versions() { return PINOCCHIO_VERSION " " CASADI_VERSION_STRING; }

// Return 0 and the serialised functions, one per line, or 1 and the message of an error.  `parents`
// counts from 1 (0 is the world), `rotations` is row-major; `text` stays valid until the next call.
EXPORT int pathwalker_build(int n_joints, const int* parents, const int* types,
                            const double* rotations, int n_points, const int* point_joints,
                            const double* gravity, const char** text) {
  int status = 0;
  try {
    answer.clear();
    for (const Function& function :
         build(n_joints, parents, types, rotations, n_points, point_joints, gravity))
      answer += function.serialize() + '\n';
  } catch (const std::exception& error) {
    answer = error.what();
    status = 1;
  }
  *text = answer.c_str();
  return status;
}
