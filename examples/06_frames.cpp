/// Two piles of rocks meet at their escape speed. What one learns: frames for ParaView from a loop of one's
/// own, contacts, and what each phase of a step cost. Open frames/merger.pvd, glyph by `radius`.
///
/// 06_frames [steps]

#include "scenes/scenes.hpp"
#include <gravel/gravel.hpp>

#include <CLI/CLI.hpp>

#include <cstdio>

int main(int argc, char** argv) {
  int steps = 1500;
  CLI::App app{"Two piles of rocks meet. Frames for ParaView go to the folder frames."};
  app.add_option("steps", steps, "of 4 s each; default: 1500")->check(CLI::Range(1, 1'000'000));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  gravel::scenes::CloudOptions cloud;
  cloud.count = 150;
  cloud.radius = 100.0;
  const auto rocks = gravel::scenes::rubbleCloud<double>(cloud);
  double mass = 0.0;
  for (const auto& rock : rocks) {
    mass += rock.mass;
  }

  gravel::SimulationConfig<double> config;
  config.timeStep = 4.0;
  config.adaptiveTimeStep = false;
  gravel::Space<double> space(config);
  const double distance = 320.0;
  const double speed =
      std::sqrt(2.0 * config.G * 2.0 * mass / distance);  // two bodies fall from rest at infinity
  for (const double side : {-1.0, 1.0}) {
    for (auto rock : rocks) {
      rock.position += gravel::Vector3<double>(side * distance / 2, side * 20.0, 0.0);
      rock.velocity -= gravel::Vector3<double>(side * speed / 2, 0.0, 0.0);
      space.addBody(rock);
    }
  }

  gravel::VtkSeries frames("frames", "merger");
  for (int step = 0; step <= steps; ++step) {
    if (step % 50 == 0) {
      frames.write(gravel::vtkPoints(space.bodies()), space.time());
    }
    space.computeDynamics(space.steps());
  }
  std::printf("%zu contacts after %.1f h; %zu frames in %s\n\n", space.contactCount(), space.time() / 3600.0,
              frames.frames(), frames.index().string().c_str());
  space.printProfilingReport();
}
