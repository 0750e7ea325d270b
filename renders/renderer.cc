#include "renders/renderer.h"

#include <dlfcn.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <mutex>
#include <string>
#include <string_view>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/engine/engine.h"
#include "harness/engine/mujoco_release.h"

namespace dexcheck {

const Mesa& LoadMesa() {
  static const Mesa loaded = [] {
    const std::string name = "libOSMesa.so.8";
    // The library's symbols are global, because MuJoCo looks for Mesa among them.
    void* const library = ::dlopen(name.c_str(), RTLD_NOW | RTLD_GLOBAL);
    if (library == nullptr) throw Error(name + ": cannot be loaded: " + ::dlerror());
    const auto find = [&](const char* function) {
      void* const address = ::dlsym(library, function);
      if (address == nullptr) throw Error(name + ": has no function " + function);
      return address;
    };
    Mesa mesa{};
#define DEXCHECK_FIND(function) mesa.function = reinterpret_cast<decltype(mesa.function)>(find(#function));
    DEXCHECK_MESA(DEXCHECK_FIND)
#undef DEXCHECK_FIND
    return mesa;
  }();
  return loaded;
}

namespace {

constexpr int kSurfaceSize = 16;
constexpr int kDepthBits = 24;
constexpr int kStencilBits = 8;

// Each frame is drawn by one thread; videos draw several frames at once in processes instead, which would not
// have their parent's threads. Mesa's cache of shaders wants a home folder, and complains on standard error
// where there is none. OSMesa has two drivers and crashes when the environment names another one, such as the
// d3d12 of WSL2.
void ConfigureMesa() {
  static std::once_flag once;
  std::call_once(once, [] {
    ::setenv("LP_NUM_THREADS", "0", /*overwrite=*/1);
    ::setenv("MESA_SHADER_CACHE_DISABLE", "true", /*overwrite=*/0);
    const char* const driver = std::getenv("GALLIUM_DRIVER");
    if (driver != nullptr && std::string_view(driver) != "softpipe") ::unsetenv("GALLIUM_DRIVER");
  });
}

}  // namespace

OffscreenContext::OffscreenContext() : buffer_(4 * kSurfaceSize * kSurfaceSize) {
  ConfigureMesa();
  context_ = LoadMesa().OSMesaCreateContextExt(OSMESA_RGBA, kDepthBits, kStencilBits, 0, nullptr);
  if (context_ == nullptr) throw Error("OSMesa: cannot make an OpenGL context");
  MakeCurrent();
}

OffscreenContext::~OffscreenContext() { LoadMesa().OSMesaDestroyContext(context_); }

void OffscreenContext::MakeCurrent() {
  if (LoadMesa().OSMesaGetCurrentContext() == context_) return;
  if (LoadMesa().OSMesaMakeCurrent(context_, buffer_.data(), GL_UNSIGNED_BYTE, kSurfaceSize, kSurfaceSize) !=
      GL_TRUE) {
    throw Error("OSMesa: cannot make an OpenGL context current");
  }
}

namespace {

constexpr int kConeSides = 48;

/// Makes the shell of a cone about z that opens from the origin, of height 1 and radius 1 at its end, seen
/// from both sides, which MuJoCo's scenes lack. @returns an OpenGL display list of the current context.
unsigned MakeCone() {
  const unsigned list = LoadMesa().glGenLists(1);
  if (list == 0) throw Error("OpenGL: cannot make a display list");
  LoadMesa().glNewList(list, GL_COMPILE);
  LoadMesa().glBegin(GL_TRIANGLES);
  for (const bool outside : {true, false}) {
    const float sign = outside ? 1.0F : -1.0F;
    for (int k = 0; k < kConeSides; ++k) {
      const auto vertex = [&](int i, float z) {
        const double angle = 2.0 * kPi * i / kConeSides;
        const auto c = static_cast<float>(std::cos(angle));
        const auto s = static_cast<float>(std::sin(angle));
        LoadMesa().glNormal3f(sign * c, sign * s, -sign);
        LoadMesa().glVertex3f(z * c, z * s, z);
      };
      vertex(k, 0.0F);
      vertex(outside ? k + 1 : k, 1.0F);
      vertex(outside ? k : k + 1, 1.0F);
    }
  }
  LoadMesa().glEnd();
  LoadMesa().glEndList();
  return list;
}

constexpr int kLargestWidth = 3840;
constexpr int kLargestHeight = 2160;
constexpr int kSmallest = 16;
constexpr int kMostDecorations = 4000;
// Sides of round geoms, and rings of them.
constexpr int kSlices = 24, kStacks = 8;

// MuJoCo loads its OpenGL functions into globals whenever a context is made.
std::mutex context_mutex;

void CheckOptions(const RenderOptions& options) {
  const auto check = [](const char* name, int value, int least, int most) {
    Require(least <= value && value <= most, name,
            "must be from " + std::to_string(least) + " to " + std::to_string(most), value);
  };
  check("width", options.width, kSmallest, kLargestWidth);
  check("height", options.height, kSmallest, kLargestHeight);
  check("samples", options.samples, 1, 4);
  check("shadow_size", options.shadow_size, 16, 8192);
}

constexpr int kCourse = -1;

/// The camera's id, or kCourse. @throws InputError that lists the cameras.
int FindCamera(const mjModel& model, const std::string& name) {
  const int id = mj_name2id(&model, mjOBJ_CAMERA, name.c_str());
  if (id >= 0) return id;
  if (name == kCourseCamera) return kCourse;
  std::string known;
  for (const std::string& camera : ListCameras(model)) known += (known.empty() ? "" : ", ") + camera;
  throw InputError("camera: no " + Quote(name) + " in the model, which has " +
                   (known.empty() ? "no cameras" : known) + "; besides there is " + kCourseCamera +
                   ", and for a run robot and object");
}

int FindBody(const mjModel& model, const std::string& name) {
  if (name.empty()) return -1;
  const int id = mj_name2id(&model, mjOBJ_BODY, name.c_str());
  if (id < 0) throw InputError("body: no " + Quote(name) + " in the model");
  return id;
}

mjvCamera MakeFreeCamera(const Viewpoint& from) {
  mjvCamera view;
  mjv_defaultCamera(&view);
  view.type = mjCAMERA_FREE;
  std::copy_n(from.look_at.data(), 3, view.lookat);
  view.distance = from.distance;
  view.azimuth = RadToDeg(from.azimuth);
  view.elevation = RadToDeg(from.elevation);
  return view;
}

constexpr float kGlow = 0.35F;  // emission, so that colours stay recognisable in shadow

/// Adds decorations to a scene.
class GeomAdder {
 public:
  /// @param cone number of the mesh that is a cone: mjr_render draws a mesh by calling the display list of
  /// its number, counted from the first mesh.
  GeomAdder(int cone, mjvScene* scene) : cone_(cone), scene_(*scene) {}

  void operator()(const Arrow& arrow) {
    const Vector3d along = arrow.to - arrow.from;
    if (along.norm() <= arrow.radius) return;
    // The engine draws arrows half as long as their given length.
    const Vector3d end = arrow.from + (arrow.has_tip ? 2.0 : 1.0) * along;
    const int type = arrow.has_tip ? mjGEOM_ARROW : mjGEOM_CAPSULE;
    MakeConnector(type, arrow.radius, arrow.from.data(), end.data(), &Add(type, arrow.color));
  }

  void operator()(const Cone& cone) {
    mjvGeom& geom = Add(mjGEOM_MESH, cone.color);
    geom.dataid = cone_;
    const Vector3d x = cone.axis.unitOrthogonal();
    const Vector3d y = cone.axis.cross(x);
    const double radius = cone.height * std::tan(cone.half_angle);
    Matrix3d scaled;
    scaled << radius * x, radius * y, cone.height * cone.axis;
    Place(cone.apex, scaled, &geom);
  }

 private:
  mjvGeom& Add(int type, const Color& color) {
    Require(scene_.ngeom < scene_.maxgeom, "decorations", "must fit into the scene's number of geoms",
            scene_.maxgeom);
    mjvGeom& geom = scene_.geoms[scene_.ngeom++];
    // mjv_initGeom leaves some members, such as what transparent geoms are sorted by, as they were.
    geom = mjvGeom{};
    mjv_initGeom(&geom, type, nullptr, nullptr, nullptr, color.data());
    geom.category = mjCAT_DECOR;
    geom.emission = kGlow;
    geom.specular = 0.3F;
    geom.shininess = 0.4F;
    return geom;
  }

  /// @param scaled rotation whose columns carry the shape's sizes.
  static void Place(const Vector3d& p, const Matrix3d& scaled, mjvGeom* geom) {
    for (int i = 0; i < 3; ++i) {
      geom->pos[i] = static_cast<float>(p[i]);
      for (int j = 0; j < 3; ++j) geom->mat[3 * i + j] = static_cast<float>(scaled(i, j));
    }
  }

  int cone_;
  mjvScene& scene_;
};

}  // namespace

std::vector<std::string> ListCameras(const mjModel& model) {
  std::vector<std::string> names;
  names.reserve(static_cast<size_t>(model.ncam));
  for (int id = 0; id < model.ncam; ++id) names.push_back(NameOf(model, mjOBJ_CAMERA, id));
  return names;
}

void CheckCamera(const mjModel& model, const std::string& name) { FindCamera(model, name); }

Renderer::Renderer(const mjModel& model, const RenderOptions& options)
    : model_(model),
      options_(options),
      camera_(FindCamera(model, options.camera)),
      translucent_body_(FindBody(model, options.translucent_body)) {
  CheckOptions(options);
  const std::lock_guard lock(context_mutex);
  gl_.emplace();
  mjv_defaultOption(&visible_);
  mjv_defaultPerturb(&perturb_);
  mjv_defaultScene(&scene_);
  mjv_makeScene(&model, &scene_, static_cast<int>(model.ngeom) + kMostDecorations);
  mjr_defaultContext(&context_);
  // The context takes its sizes from the model's visual section.
  const MjModelPtr sized(mj_copyModel(nullptr, &model));
  sized->vis.global.offwidth = options.samples * options.width;
  sized->vis.global.offheight = options.samples * options.height;
  sized->vis.quality.offsamples = 0;
  sized->vis.quality.shadowsize = options.shadow_size;
  sized->vis.quality.numslices = kSlices;
  sized->vis.quality.numstacks = kStacks;
  mjr_makeContext(sized.get(), &context_, mjFONTSCALE_100);
  mjr_setBuffer(mjFB_OFFSCREEN, &context_);
  cone_ = MakeCone();
  scene_.flags[mjRND_SHADOW] = 1;
  scene_.flags[mjRND_REFLECTION] = 0;
  pixels_.resize(3 * static_cast<size_t>(options.samples * options.width) *
                 static_cast<size_t>(options.samples * options.height));
}

// A context that was current once is made so again.
Renderer::~Renderer() {  // NOLINT(bugprone-exception-escape)
  gl_->MakeCurrent();
  LoadMesa().glDeleteLists(cone_, 1);
  mjr_freeContext(&context_);
  mjv_freeScene(&scene_);
}

Image Renderer::Render(mjData& data, std::span<const Decoration> decorations) {
  return Draw(data, MakeCamera(camera_), options_.width, options_.height, options_.shift_right, decorations);
}

Image Renderer::Render(mjData& data, const Viewpoint& from, int width, int height,
                       std::span<const Decoration> decorations) {
  return Draw(data, MakeFreeCamera(from), width, height, 0.0, decorations);
}

Image Renderer::Render(mjData& data, const std::string& camera, int width, int height,
                       std::span<const Decoration> decorations) {
  return Draw(data, MakeCamera(FindCamera(model_, camera)), width, height, 0.0, decorations);
}

Image Renderer::Draw(mjData& data, mjvCamera view, int width, int height, double shift_right,
                     std::span<const Decoration> decorations) {
  constexpr const char* kRoom = "must fit into the renderer's picture";
  Require(kSmallest <= width && width <= options_.width, "width", kRoom, width);
  Require(kSmallest <= height && height <= options_.height, "height", kRoom, height);
  gl_->MakeCurrent();
  mjv_updateScene(&model_, &data, &visible_, &perturb_, &view, mjCAT_ALL, &scene_);
  if (view.type == mjCAMERA_FREE) shift_right = 0.0;
  for (mjvGLCamera& eye : scene_.camera) {
    const double visible = static_cast<double>(eye.frustum_top - eye.frustum_bottom) * width / height;
    eye.frustum_center -= static_cast<float>(shift_right * visible);
  }
  FadeBody();
  GeomAdder adder(static_cast<int>(cone_) - static_cast<int>(context_.baseMesh), &scene_);
  for (const Decoration& decoration : decorations) std::visit(adder, decoration);
  const mjrRect viewport = {0, 0, options_.samples * width, options_.samples * height};
  mjr_render(viewport, &scene_, &context_);
  mjr_readPixels(pixels_.data(), nullptr, viewport, &context_);
  return ReduceBottomUp(pixels_.data(), width, height, options_.samples);
}

mjvCamera Renderer::MakeCamera(int camera) const {
  if (camera == kCourse) return MakeFreeCamera(options_.course);
  mjvCamera view;
  mjv_defaultCamera(&view);
  view.type = mjCAMERA_FIXED;
  view.fixedcamid = camera;
  return view;
}

void Renderer::FadeBody() {
  constexpr float kOpacity = 0.35F;
  if (translucent_body_ < 0) return;
  for (int i = 0; i < scene_.ngeom; ++i) {
    mjvGeom& geom = scene_.geoms[i];
    if (geom.objtype != mjOBJ_GEOM || model_.geom_bodyid[geom.objid] != translucent_body_) continue;
    geom.rgba[3] = std::min(geom.rgba[3], kOpacity);
  }
}

}  // namespace dexcheck
