#include "harness/report/replay.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <set>

#include "controller/object/so3.h"
#include "harness/corrections/printed_robot.h"
#include "harness/engine/engine.h"
#include "harness/engine/map_vector.h"
#include "renders/renderer.h"
#include "renders/viewpoint.h"

namespace dexcheck {

namespace {

using Json = nlohmann::ordered_json;

static_assert(std::endian::native == std::endian::little, "browsers read the numbers in this order");

constexpr int kVisibleGroups = 3;          // those that the engine shows by default
constexpr double kQuaternionUnit = 32767;  // of a 2-byte number
constexpr double kTimeUnit = 1e6;          // times in microseconds' resolution, which keeps their text short
constexpr double kShapeUnit = 1e6;         // sizes in micrometres' resolution, too

double Round(double value, double unit) { return std::round(unit * value) / unit; }

Json ToJson(const Eigen::Ref<const VectorXd>& values) {
  Json json = Json::array();
  for (const double value : values) json.push_back(Round(value, kShapeUnit));
  return json;
}

class ReplayMaker {
 public:
  ReplayMaker(const mjModel& model, const RunFrames& run) : model_(model), run_(run), data_(MakeData(model)) {
    ChooseRows();
    SetRow(model_, run_, rows_.front(), data_.get());
  }

  ReplayData Make() {
    AddShapes();
    AddCameras();
    AddMotion();
    AddContacts();
    AddObject();
    AddPhases();
    return {json_, bytes_};
  }

 private:
  void ChooseRows() {
    const double duration = run_.duration();
    const long wanted = std::lround(std::ceil(kReplayRate * duration)) + 1;
    const long count = std::clamp(wanted, 2L, kMostReplayFrames);
    for (long k = 0; k < count; ++k) {
      // RowAt takes the row before; half a row's time more takes the nearest.
      const double t =
          run_.times.front() + duration * static_cast<double>(k) / static_cast<double>(count - 1);
      const long row = run_.RowAt(t + 0.5 * duration / static_cast<double>(run_.rows()));
      if (!rows_.empty() && row == rows_.back()) continue;
      rows_.push_back(row);
      json_["times"].push_back(Round(run_.times[static_cast<size_t>(row)], kTimeUnit));
    }
  }

  [[nodiscard]] bool IsShown(int geom) const {
    return model_.geom_group[geom] < kVisibleGroups && Color(geom)[3] > 0.0F &&
           model_.geom_type[geom] != mjGEOM_HFIELD;
  }

  /// The colour that the engine shows: a geom's own, unless it is the default one and the geom has a
  /// material.
  [[nodiscard]] std::array<float, 4> Color(int geom) const {
    const float* const own = model_.geom_rgba + 4 * geom;
    constexpr std::array<float, 4> kDefault = {0.5F, 0.5F, 0.5F, 1.0F};
    const int material = model_.geom_matid[geom];
    const bool is_default = std::equal(kDefault.begin(), kDefault.end(), own);
    const float* const rgba = material >= 0 && is_default ? model_.mat_rgba + 4 * material : own;
    return {rgba[0], rgba[1], rgba[2], rgba[3]};
  }

  /// Number of the part that a body belongs to; 0 is the world.
  int FindPart(int body) {
    const int root = model_.body_weldid[body];
    if (root == 0) return 0;
    const auto [found, is_new] = part_of_.try_emplace(root, static_cast<int>(parts_.size()) + 1);
    if (is_new) parts_.push_back(root);
    return found->second;
  }

  void AddShapes() {
    json_["shapes"] = Json::array();
    for (int geom = 0; geom < model_.ngeom; ++geom) {
      if (IsShown(geom)) AddShape(geom);
    }
    AddMeshes();
    json_["parts"] = parts_.size() + 1;
  }

  void AddShape(int geom) {
    static const std::map<int, const char*> kNames = {
        {mjGEOM_PLANE, "plane"},       {mjGEOM_SPHERE, "sphere"},
        {mjGEOM_CAPSULE, "capsule"},   {mjGEOM_ELLIPSOID, "ellipsoid"},
        {mjGEOM_CYLINDER, "cylinder"}, {mjGEOM_BOX, "box"},
        {mjGEOM_MESH, "mesh"}};
    const auto name = kNames.find(model_.geom_type[geom]);
    if (name == kNames.end()) return;
    const int body = model_.geom_bodyid[geom];
    const Pose X_WG = MapPose(data_->geom_xmat + 9 * geom, data_->geom_xpos + 3 * geom);
    const Pose X_PG = BodyPose(*data_, model_.body_weldid[body]).inverse() * X_WG;
    const std::array<float, 4> color = Color(geom);
    const int material = model_.geom_matid[geom];
    Json shape = {
        {"part", FindPart(body)},
        {"type", name->second},
        {"size", ToJson(Eigen::Map<const Vector3d>(model_.geom_size + 3 * geom))},
        {"position", ToJson(X_PG.translation())},
        {"quaternion", ToJson(ToQuaternion(X_PG.linear()))},
        {"color", {Round(color[0], 1e3), Round(color[1], 1e3), Round(color[2], 1e3), Round(color[3], 1e3)}}};
    if (material >= 0 && model_.mat_emission[material] > 0.0F) shape["glow"] = true;
    if (model_.geom_type[geom] == mjGEOM_MESH) {
      const auto next = static_cast<int>(meshes_.size());
      const auto [mesh, is_new] = mesh_of_.try_emplace(model_.geom_dataid[geom], next);
      if (is_new) meshes_.push_back(model_.geom_dataid[geom]);
      shape["mesh"] = mesh->second;
    }
    json_["shapes"].push_back(shape);
  }

  [[nodiscard]] TriangleMesh ReadMesh(int id) const {
    TriangleMesh mesh;
    const float* const vertices = model_.mesh_vert + 3 * model_.mesh_vertadr[id];
    for (int k = 0; k < model_.mesh_vertnum[id]; ++k) {
      mesh.vertices.push_back({vertices[3 * k], vertices[3 * k + 1], vertices[3 * k + 2]});
    }
    const int* const faces = model_.mesh_face + 3 * model_.mesh_faceadr[id];
    for (int k = 0; k < model_.mesh_facenum[id]; ++k) {
      mesh.faces.push_back({faces[3 * k], faces[3 * k + 1], faces[3 * k + 2]});
    }
    return mesh;
  }

  void AddMeshes() {
    int total = 0;
    for (const int id : meshes_) total += model_.mesh_facenum[id];
    const double fraction = std::min(1.0, static_cast<double>(kMostReplayTriangles) / std::max(total, 1));
    json_["meshes"] = Json::array();
    for (const int id : meshes_) {
      const auto most = static_cast<size_t>(std::floor(fraction * model_.mesh_facenum[id]));
      const TriangleMesh mesh = SimplifyMesh(ReadMesh(id), most);
      const size_t vertices = Align();
      for (const auto& vertex : mesh.vertices) {
        for (const float x : vertex) Append(x);
      }
      const size_t faces = bytes_.size();
      const bool is_small = mesh.vertices.size() < 65536;
      for (const auto& face : mesh.faces) {
        for (const int corner : face) {
          if (is_small) {
            Append(static_cast<std::uint16_t>(corner));
          } else {
            Append(static_cast<std::uint32_t>(corner));
          }
        }
      }
      json_["meshes"].push_back({{"vertices", {vertices, mesh.vertices.size()}},
                                 {"faces", {faces, mesh.faces.size()}},
                                 {"bytes", is_small ? 2 : 4}});
    }
  }

  /// Cameras of the model as they stand at the beginning, with the part that they go along with; one that
  /// sees the whole run where the model has none.
  void AddCameras() {
    json_["cameras"] = Json::array();
    if (model_.ncam == 0 && !parts_.empty()) AddCourse();
    for (int id = 0; id < model_.ncam; ++id) {
      const Vector3d p(data_->cam_xpos + 3 * id);
      const RotationMap R(data_->cam_xmat + 9 * id);
      const int body = model_.cam_bodyid[id];
      json_["cameras"].push_back({{"name", NameOf(model_, mjOBJ_CAMERA, id)},
                                  {"position", ToJson(p)},
                                  {"forward", ToJson(-R.col(2))},
                                  {"fovy", model_.cam_fovy[id]},
                                  {"part", FindPart(body)}});
    }
    json_["parts"] = parts_.size() + 1;
  }

  void AddCourse() {
    constexpr double kFovy = 40.0, kAspect = 16.0 / 9.0;
    const double up = std::tan(0.5 * DegToRad(kFovy)), side = kAspect * up;
    const MjDataPtr data = MakeData(model_);
    const Viewpoint view = FindCourse(model_, run_, {side, side, up, up}, data.get());
    const Vector3d forward(std::cos(view.elevation) * std::cos(view.azimuth),
                           std::cos(view.elevation) * std::sin(view.azimuth), std::sin(view.elevation));
    json_["cameras"].push_back({{"name", kCourseCamera},
                                {"position", ToJson(view.look_at - view.distance * forward)},
                                {"forward", ToJson(forward)},
                                {"fovy", kFovy},
                                {"part", 0}});
  }

  /// Adds of each frame and part its position, and quaternion w, x, y, z.
  void AddMotion() {
    std::vector<Pose> poses;
    for (const long row : rows_) {
      SetRow(model_, run_, row, data_.get());
      for (const int body : parts_) poses.push_back(BodyPose(*data_, body));
    }
    json_["positions"] = Align();
    for (const Pose& X : poses) {
      for (const double x : X.translation()) Append(static_cast<float>(x));
    }
    json_["quaternions"] = bytes_.size();
    for (const Pose& X : poses) {
      for (const double x : ToQuaternion(X.linear()))
        Append(static_cast<std::int16_t>(std::lround(kQuaternionUnit * x)));
    }
  }

  size_t AddRows(const RowMatrixXd& matrix) {
    const size_t begin = Align();
    for (const long row : rows_) {
      for (const double x : matrix.row(row)) Append(static_cast<float>(x));
    }
    return begin;
  }

  void AddContacts() {
    if (run_.contacts() == 0 || run_.contact_forces.size() == 0) return;
    Json& contacts = json_["contacts"];
    contacts["count"] = run_.contacts();
    contacts["positions"] = AddRows(run_.contact_positions);
    contacts["forces"] = AddRows(run_.contact_forces);
    contacts["meters_per_newton"] = CalcMetersPerNewton(run_);
    if (run_.contact_normals.size() == 0 || !(run_.friction > 0.0)) return;
    contacts["normals"] = AddRows(run_.contact_normals);
    contacts["friction"] = run_.friction;
  }

  void AddObject() {
    const int body =
        run_.object_body.empty() ? -1 : mj_name2id(&model_, mjOBJ_BODY, run_.object_body.c_str());
    const auto part = body < 0 ? part_of_.end() : part_of_.find(model_.body_weldid[body]);
    if (part == part_of_.end()) return;
    Json& object = json_["object"];
    object["part"] = part->second;
    if (run_.desired_positions.size() == 0) return;
    object["desired_positions"] = AddRows(run_.desired_positions);
    if (run_.desired_angles.size() == 0) return;
    RowMatrixXd quaternions(run_.rows(), 4);
    for (const long row : rows_) {
      const Vector3d zyz = run_.desired_angles.row(row).transpose();
      quaternions.row(row) = ToQuaternion(CalcRotationZyz(zyz)).transpose();
    }
    object["desired_quaternions"] = AddRows(quaternions);
  }

  /// Adds the begin of each phase of a task.
  void AddPhases() {
    json_["phases"] = Json::array();
    for (size_t row = 0; row < run_.phases.size(); ++row) {
      if (row > 0 && run_.phases[row] == run_.phases[row - 1]) continue;
      json_["phases"].push_back({{"time", Round(run_.times[row], kTimeUnit)}, {"name", run_.phases[row]}});
    }
  }

  template <typename Number>
  void Append(Number number) {
    const auto chars = std::bit_cast<std::array<char, sizeof(Number)>>(number);
    bytes_.append(chars.data(), chars.size());
  }

  /// Fills up with zeros to where a 4-byte number may begin, and returns this place.
  size_t Align() {
    while (bytes_.size() % 4 != 0) bytes_ += '\0';
    return bytes_.size();
  }

  const mjModel& model_;
  const RunFrames& run_;
  MjDataPtr data_;
  std::vector<long> rows_;
  std::vector<int> parts_;      // the body of each part but the world
  std::map<int, int> part_of_;  // by body
  std::vector<int> meshes_;     // ids
  std::map<int, int> mesh_of_;  // number in meshes_, by id
  Json json_;
  std::string bytes_;
};

}  // namespace

ReplayData MakeReplayData(const mjModel& model, const RunFrames& run) {
  return ReplayMaker(model, run).Make();
}

namespace {

constexpr double kFinest = 400.0;  // cells along the longest side
constexpr double kCoarsening = 1.3;

using Cell = std::array<int, 3>;

struct Cluster {
  std::array<double, 3> sum{};
  int count = 0;
  int index = 0;
};

/// @param size of a cell's edge, m.
TriangleMesh Cluster(const TriangleMesh& mesh, double size) {
  std::map<Cell, struct Cluster> clusters;
  std::vector<int> where;
  for (const std::array<float, 3>& p : mesh.vertices) {
    Cell cell;
    for (size_t k = 0; k < 3; ++k) cell[k] = static_cast<int>(std::floor(p[k] / size));
    auto [found, is_new] = clusters.try_emplace(cell);
    struct Cluster& cluster = found->second;
    if (is_new) cluster.index = static_cast<int>(clusters.size()) - 1;
    for (size_t k = 0; k < 3; ++k) cluster.sum[k] += p[k];
    ++cluster.count;
    where.push_back(cluster.index);
  }
  TriangleMesh coarse;
  coarse.vertices.resize(clusters.size());
  for (const auto& [cell, cluster] : clusters) {
    for (size_t k = 0; k < 3; ++k) {
      coarse.vertices[static_cast<size_t>(cluster.index)][k] =
          static_cast<float>(cluster.sum[k] / cluster.count);
    }
  }
  std::set<std::array<int, 3>> known;
  for (const std::array<int, 3>& face : mesh.faces) {
    std::array<int, 3> corners;
    for (size_t k = 0; k < 3; ++k) corners[k] = where[static_cast<size_t>(face[k])];
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
    // A face is the same whichever corner it begins with.
    std::rotate(corners.begin(), std::ranges::min_element(corners), corners.end());
    if (known.insert(corners).second) coarse.faces.push_back(corners);
  }
  return coarse;
}

}  // namespace

TriangleMesh SimplifyMesh(const TriangleMesh& mesh, size_t most_faces) {
  if (mesh.faces.size() <= most_faces || mesh.vertices.empty()) return mesh;
  double extent = 0.0;
  for (size_t k = 0; k < 3; ++k) {
    const auto [low, high] = std::minmax_element(mesh.vertices.begin(), mesh.vertices.end(),
                                                 [k](const auto& a, const auto& b) { return a[k] < b[k]; });
    extent = std::max(extent, static_cast<double>((*high)[k]) - (*low)[k]);
  }
  TriangleMesh coarse;
  for (double cells = kFinest; cells > 1.0; cells /= kCoarsening) {
    coarse = Cluster(mesh, extent / cells);
    if (coarse.faces.size() <= most_faces) break;
  }
  return coarse;
}

}  // namespace dexcheck
