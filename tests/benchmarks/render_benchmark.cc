// Measures the cost of a video beyond MuJoCo's own drawing: the same frames drawn by mjr_render and
// mjr_readPixels alone, and as a video with panel and encoding. Both use two processes. The benchmark counts
// processor time, because the wall clock also counts other programs' work.
//
// render_benchmark [FRAMES]

#include <fmt/format.h>
#include <mujoco/mujoco.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <vector>

#include "controller/common/errors.h"
#include "harness/engine/engine.h"
#include "renders/renderer.h"
#include "renders/video.h"
#include "renders/viewpoint.h"
#include "tests/benchmarks/measured_time.h"
#include "tests/common/files.h"
#include "tests/common/paths.h"
#include "tests/renders/kinematic_run.h"

namespace dexcheck {
namespace {

/// Draws every n-th frame with the engine's functions and nothing else.
void DrawBare(const mjModel& model, const RunFrames& run, const VideoOptions& options, long first,
              long frames) {
  const int width = options.samples * options.width;
  const int height = options.samples * options.height;
  const MjDataPtr data = MakeData(model);
  OffscreenContext gl;
  mjvScene scene;
  mjvOption visible;
  mjvCamera camera;
  mjrContext context;
  const MjModelPtr sized(mj_copyModel(nullptr, &model));
  sized->vis.global.offwidth = width;
  sized->vis.global.offheight = height;
  sized->vis.quality.offsamples = 0;
  sized->vis.quality.shadowsize = options.shadow_size;
  sized->vis.quality.numslices = 24;
  sized->vis.quality.numstacks = 8;
  mjv_defaultScene(&scene);
  mjv_makeScene(&model, &scene, 2000);
  scene.flags[mjRND_REFLECTION] = 0;
  mjv_defaultOption(&visible);
  mjv_defaultCamera(&camera);
  mjr_defaultContext(&context);
  mjr_makeContext(sized.get(), &context, mjFONTSCALE_100);
  mjr_setBuffer(mjFB_OFFSCREEN, &context);
  camera.type = mjCAMERA_FIXED;
  camera.fixedcamid = mj_name2id(&model, mjOBJ_CAMERA, options.camera.c_str());
  std::vector<unsigned char> pixels(3 * static_cast<size_t>(width) * static_cast<size_t>(height));
  const mjrRect viewport = {0, 0, width, height};
  for (long frame = first; frame < frames; frame += options.workers) {
    SetRow(model, run, run.RowAt(static_cast<double>(frame) / options.fps), data.get());
    mjv_updateScene(&model, data.get(), &visible, nullptr, &camera, mjCAT_ALL, &scene);
    mjr_render(viewport, &scene, &context);
    mjr_readPixels(pixels.data(), nullptr, viewport, &context);
  }
  mjr_freeContext(&context);
  mjv_freeScene(&scene);
}

int Run(long frames) {
  const MjModelPtr model = LoadMjcf(testing::SourcePath("/mjcf/scene.xml"));
  const VideoOptions options;
  const RunFrames run = testing::MakeKinematicRun(*model, static_cast<double>(frames) / options.fps, 0.001);
  const testing::TempFolder folder;
  fmt::print("{} frames of {} x {}, {} samples a pixel, {} processes\n", frames, options.width,
             options.height, options.samples * options.samples, options.workers);

  const MeasuredTime bare = Measure([&] {
    for (int k = 0; k < options.workers; ++k) {
      if (::fork() != 0) continue;
      DrawBare(*model, run, options, k, frames);
      ::_exit(EXIT_SUCCESS);
    }
    int status = 0;
    while (::wait(&status) > 0) {
      if (status != EXIT_SUCCESS) throw Error("a process that draws died");
    }
  });
  const MeasuredTime video = Measure([&] {
    VideoWriter video(folder.path() / "video.mp4", options);
    RenderVideo({model.get(), &run}, options, &video);
    video.Finish();
  });
  const auto per_frame = [&](double seconds) { return 1e3 * seconds / static_cast<double>(frames); };
  fmt::print("{:<34}{:>10}{:>14}{:>12}\n", "", "wall", "processor", "a frame");
  fmt::print("{:<34}{:>8.1f} s{:>12.1f} s{:>9.1f} ms\n", "mjr_render and mjr_readPixels", bare.wall,
             bare.processor, per_frame(bare.processor));
  fmt::print("{:<34}{:>8.1f} s{:>12.1f} s{:>9.1f} ms\n", "video with panel, encoded", video.wall,
             video.processor, per_frame(video.processor));
  fmt::print("overlay and encoding cost {:.1f} % more processor time ({:.1f} % by the wall clock)\n",
             100.0 * (video.processor / bare.processor - 1.0), 100.0 * (video.wall / bare.wall - 1.0));
  return 0;
}

}  // namespace
}  // namespace dexcheck

int main(int argc, char** argv) {
  constexpr long kFrames = 300;
  return dexcheck::Run(argc > 1 ? std::strtol(argv[1], nullptr, 10) : kFrames);
}
