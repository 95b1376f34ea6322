/// gravel-run: reads a scene, simulates it, and writes frames, a table, a picture and a summary.

#include "builtin_scene.hpp"
#include "diagnostics.hpp"
#include "drive.hpp"
#include "picture.hpp"
#include "progress.hpp"
#include "restart.hpp"
#include "scene.hpp"
#include "summary.hpp"
#include "text.hpp"

#include <CLI/CLI.hpp>

#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <new>
#include <string_view>
#include <system_error>
#include <utility>

#ifdef _OPENMP
#include <omp.h>
#endif
#ifdef __linux__
#include <unistd.h>
#endif
#if __has_include(<sys/file.h>)
#include <fcntl.h>
#include <sys/file.h>
#endif

namespace {

using namespace gravel;
using namespace gravel::runner;
namespace fs = std::filesystem;

volatile std::sig_atomic_t stopRequested = 0;

/// The first signal ends the run in order, a second one the program at once.
void requestStop(int signal) {
  stopRequested = 1;
  std::signal(signal, SIG_DFL);
}

void onStopSignals(void (*handler)(int)) {
  std::signal(SIGINT, handler);
  std::signal(SIGTERM, handler);
}

struct Options {
  std::string sceneFile, output, save, restart;
  std::optional<double> duration;
  std::optional<std::size_t> frames;
  int threads = 0;
  bool noPicture = false, quiet = false, check = false, profile = false;
};

/// The space of a scene, fit for its first step. \throws std::invalid_argument if the space refuses something
Space<double> makeSpace(const Scene& scene) {
  Space<double> space(scene.config);
  space.setDomain(scene.domain);
  space.setUniformField(scene.field);
  for (const Material<double>& material : scene.materials) {
    space.addMaterial(material);
  }
  for (const auto& [first, second, material] : scene.pairs) {
    space.setPairMaterial(MaterialId{first}, MaterialId{second}, material);
  }
  for (const ScenePlane& plane : scene.planes) {
    space.setPlaneVelocity(space.addPlane(plane.normal, plane.offset, plane.material), plane.velocity);
  }
  for (const SceneBody& entry : scene.bodies) {
    space.addBody(entry.body);
  }
  if (scene.meeting == Meeting::Merge) {
    space.setCollisionHook([](const Collision<double>&) { return CollisionOutcome<double>::merge(); });
  } else if (scene.meeting == Meeting::MergeBelowEscape) {
    space.setCollisionHook(mergeBelowEscapeSpeed(scene.config.G, scene.escapeFactor));
  }
  space.check();
  return space;
}

/// The space that a run begins with: that of the scene, or the saved one of an earlier run of it.
Space<double> firstSpace(const Scene& scene, const Options& options) {
  const std::string sceneName = options.sceneFile.empty() ? builtinSceneName : options.sceneFile;
  Space<double> space = [&] {
    try {
      return makeSpace(scene);
    } catch (const std::invalid_argument& error) {
      throw SceneError(sceneName + ": " + error.what());
    } catch (const std::bad_alloc&) {
      throw SceneError(sceneName + ": there is no memory for " +
                       counted(scene.config.bodyCount + scene.bodies.size(), "body", "bodies"));
    }
  }();
  if (!options.restart.empty()) {
    takeUp(space, scene, options.restart);
  }
  return space;
}

fs::path madeFolder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error || !fs::is_directory(folder)) {
    throw std::runtime_error("cannot make the output folder " + folder.string() + ": " +
                             (error ? error.message() : "there is a file of that name"));
  }
  return folder;
}

/// Says what is to be run, and how many bodies begin where they cannot stay.
void announce(const Scene& scene, const Space<double>& space, bool isRestart) {
  std::printf("%s: %s, %s\n", scene.title.empty() ? scene.name.c_str() : scene.title.c_str(),
              counted(space.n(), "body", "bodies").c_str(), sceneTime(scene.duration, scene.units).c_str());
  if (isRestart) {
    std::printf("taken up at %s, step %zu\n", sceneTime(space.time(), scene.units).c_str(), space.steps());
    return;
  }
  const Overlaps overlaps = overlapsAtStart(space);
  if (overlaps.bodies > 0) {
    std::printf("note: %zu of %zu bodies begin in others or behind walls, deeper than a tenth of a radius, ",
                overlaps.bodies, space.n());
    std::printf("the deepest by %.3g radii\n", overlaps.deepest);
  }
}

/// Why no file could be made beside its place as a whole one is in the end; empty if one could. What is no
/// regular file, a device or a pipe, is not touched before there is something to write.
std::string whyNotWritable(const fs::path& file) {
  if (fs::exists(file) && !fs::is_regular_file(file)) {
    return {};
  }
  fs::path part;
  std::FILE* probe = detail::openPart(detail::targetOf(file), part);
  if (probe == nullptr) {
    return detail::lastError().message();
  }
  std::fclose(probe);
  fs::remove(part);
  return {};
}

/// Refuses at the start of a run what could not be written at its end.
void prepareFile(const fs::path& file) {
  if (file.has_parent_path()) {
    madeFolder(file.parent_path());
  }
  const std::string reason = fs::is_directory(file) ? "it is a folder" : whyNotWritable(file);
  if (!reason.empty()) {
    throw std::runtime_error("cannot save to " + file.string() + ": " + reason);
  }
}

/// Saves the state, but for one that is not finite: from that no run can go on, and what an earlier one saved
/// stays.
/// \return the reason if it could not be written: the rest of the output is to come all the same
std::string saveFailure(const Space<double>& space, const std::string& file, bool isFinite) {
  try {
    if (!file.empty() && isFinite) {
      space.save(file);
    }
    return {};
  } catch (const std::exception& error) {
    return error.what();
  }
}

/// Keeps the folder for this run as long as the program lives, however it ends: two in one folder would write
/// over each other's files. Nothing happens where folders cannot be locked.
void claim(const fs::path& folder) {
#if __has_include(<sys/file.h>)
  const int handle = open(folder.c_str(), O_RDONLY | O_CLOEXEC);  // stays open, and with it the lock
  if (handle >= 0 && flock(handle, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    throw std::runtime_error("another gravel-run is writing to the output folder " + folder.string() +
                             "; wait for its end, or give another one by --output");
  }
#else
  static_cast<void>(folder);
#endif
}

/// What an earlier run said at its end is not of this one, which may end without a word.
void removeEnds(const fs::path& folder, const std::string& sceneName) {
  for (const fs::path& last :
       {fs::path("summary.txt"), fs::path("picture.png"), "frames" / fs::path(sceneName + ".pvd")}) {
    std::error_code error;
    fs::remove(folder / last, error);
    if (error) {
      throw std::runtime_error("cannot write to the output folder " + folder.string() + ": " +
                               error.message());
    }
  }
}

/// What is to be done at evenly spaced times; done at the first step at or after each, so that what is
/// written never changes what is computed.
class Schedule {
 public:
  Schedule(std::size_t times, double duration)
      : count_(times),
        duration_(duration),
        interval_(times > 1 ? duration / static_cast<double>(times - 1) : duration) {}
  /// \param step  that ended at that time; a millionth of it is rounding in the sum of steps
  bool isDue(double time, double step) {
    const double early = 1e-6 * step;
    if (next_ >= count_ || time < at(next_, early)) {
      return false;
    }
    // By division: a count one by one would not end where there are far more times than steps.
    const double passed = std::floor((time + early) / interval_), last = static_cast<double>(count_ - 1);
    next_ = std::max(next_, passed < last ? static_cast<std::size_t>(passed) : count_ - 1);
    while (next_ < count_ && time >= at(next_, early)) {  // that one, and what the quotient lost to rounding
      ++next_;
    }
    return true;
  }

 private:
  /// The last one is the end itself, which a product may pass by rounding, and nothing is that early.
  double at(std::size_t number, double early) const {
    return number > 0 && number + 1 == count_ ? duration_ : static_cast<double>(number) * interval_ - early;
  }

  std::size_t count_, next_ = 0;
  double duration_, interval_;
};

/// How long the next step is in a run of equal steps: a millionth of one that would be left at the end is
/// rounding in the sum of steps.
double nextStep(const Space<double>& space, const Scene& scene) {
  const double rest = scene.duration - space.time();
  return rest > space.getTimeStep() * (1.0 + 1e-6) ? space.getTimeStep() : rest;
}

/// Makes one step, or what is left of one until the end, so that each can be looked at. Which one an adaptive
/// run begins with, or goes on with where bodies have merged, the space finds when it makes it: until then it
/// says the longest that is allowed, or the one before. That is kept within the run for this one step; all
/// later ones may be as long as the scene says, in a run that goes on from here, too.
/// \param isNew  the bodies are not those of the last step
void stepTowards(Space<double>& space, const Scene& scene, bool isNew) {
  const double rest = scene.duration - space.time();
  const bool isChosenLater = isNew && space.config().adaptiveTimeStep && space.config().minTimeStep < rest;
  const double longest = space.config().timeStep;
  const bool isLimited = isChosenLater && longest > rest;
  if (isLimited) {
    space.setTimeStep(rest);
  }
  const double h = nextStep(space, scene);
  drive(space, scene, h);
  if (isChosenLater || h < rest) {
    space.computeDynamics(space.steps());
  } else {
    space.advanceTo(scene.duration);
  }
  if (isLimited) {
    space.setTimeStep(longest);
  }
}

/// Lets threads that wait sleep rather than spin. A step has some dozens of short parallel parts; where other
/// programs want the same processors, spinning threads take away the time of those that they wait for, and
/// make a step ten times slower. OpenMP reads this setting only when a program is loaded, so it is loaded
/// again.
void waitPassively(char** argv) {
#ifdef __linux__
  if (std::getenv("OMP_WAIT_POLICY") == nullptr && setenv("OMP_WAIT_POLICY", "passive", 0) == 0) {
    execv("/proc/self/exe", argv);  // returns only if it fails, and then nothing is lost but speed
  }
#else
  static_cast<void>(argv);
#endif
}

/// A point of a body's path, after a gap if it lies across a face of the domain.
void addToTrail(Trail& trail, const Vector3<double>& point, const Domain<double>& domain) {
  if (!trail.empty() && !domain.isOpen() &&
      ((point - trail.back()).array().abs() > 0.5 * domain.lengths().array()).any()) {
    trail.push_back(Trail::value_type::Constant(std::nan("")));
  }
  trail.push_back(point);
}

int run(const Options& options) {
  Scene scene = options.sceneFile.empty() ? readScene(builtinScene, builtinSceneName)
                                          : readSceneFile(options.sceneFile);
  scene.duration = options.duration.value_or(scene.duration);
  scene.output.frames = options.frames.value_or(scene.output.frames);

  Space<double> space = firstSpace(scene, options);
  const bool isRestart = !options.restart.empty();
  const double begin = space.time();
  const bool talks = !options.quiet;
  if (talks || options.check) {
    announce(scene, space, isRestart);
  }
  if (options.check) {
    return 0;
  }

  // The first part of a run that is taken up keeps its folder.
  const std::string name = scene.name + (isRestart ? "_from_step_" + std::to_string(space.steps()) : "");
  const fs::path folder =
      madeFolder(options.output.empty() ? fs::path("out") / name : fs::path(options.output));
  claim(folder);
  if (!options.save.empty()) {
    prepareFile(options.save);
  }
  removeEnds(folder, scene.name);
  Diagnostics diagnostics(folder / "diagnostics.csv");
  std::optional<VtkSeries> series;
  if (scene.output.frames > 0) {
    series.emplace(folder / "frames", scene.name);
  }
  Schedule frames(scene.output.frames, scene.duration);
  Schedule rows(std::max<std::size_t>(scene.output.rows, 2), scene.duration);
  Schedule marks(scene.picture.trails ? 2000 : 0, scene.duration);
  Trails trails;
  Progress progress(scene.units, scene.duration, options.quiet, space);
  space.setLog([](const char* line) { std::fprintf(stderr, "%s\n", line); });

  // A stop has its row and its frame, as the end has, whether they are due or not.
  const auto observe = [&](bool isStop) {
    if (rows.isDue(space.time(), space.getPreviousTimeStep()) || isStop) {
      diagnostics.record(space);
    }
    if (frames.isDue(space.time(), space.getPreviousTimeStep()) || (isStop && series)) {
      series->write(vtkPoints(space.bodies()), space.time());
    }
    if (marks.isDue(space.time(), space.getPreviousTimeStep())) {
      for (const auto body : space.bodies()) {
        addToTrail(trails[toInteger(body.id())], body.position(), space.domain());
      }
    }
    progress.show(space, diagnostics.history().drift());
  };

  onStopSignals(requestStop);
  // What energies are measured against has the field of the first step.
  drive(space, scene, nextStep(space, scene));
  observe(false);
  bool isStop = false;
  // A merger may have been the last that an earlier run did.
  std::size_t bodies = space.steps() == 0 || scene.meeting != Meeting::Bounce ? 0 : space.n();
  while (space.time() < scene.duration && !isStop) {
    stepTowards(space, scene, std::exchange(bodies, space.n()) != space.n());
    diagnostics.count(space);
    isStop = stopRequested != 0 && space.time() < scene.duration;
    observe(isStop);
  }
  progress.finish(space, diagnostics.history().drift());

  const RunFacts facts{isStop, begin, progress.seconds(), threadCount()};
  const std::string words = summary(scene, space, diagnostics.history(), facts);
  detail::writeFileWhole(folder / "summary.txt", words);
  if (talks) {
    std::printf("\n%s\n", words.c_str());
  }
  if (options.profile) {
    space.printProfilingReport();
  }
  const auto tell = [&](const char* what, const fs::path& path) {
    if (talks) {
      std::printf("%-9s %s\n", what, path.string().c_str());
      std::fflush(stdout);
    }
  };
  tell("Table:", folder / "diagnostics.csv");
  tell("Summary:", folder / "summary.txt");
  if (series) {
    tell("Frames:", series->index().string() + "  (" + std::to_string(series->frames()) + ", for ParaView)");
  }
  const bool isFinite = diagnostics.history().isFinite;
  const std::string failure = saveFailure(space, options.save, isFinite);
  if (!options.save.empty() && isFinite && failure.empty()) {
    tell("State:", options.save);
  }
  onStopSignals(SIG_DFL);  // all but the picture is there
  if (!options.noPicture && writePicture(folder / "picture.png", scene, space, trails)) {
    tell("Picture:", folder / "picture.png");
  }
  if (!isFinite || !failure.empty()) {
    throw std::runtime_error(isFinite ? failure : notFinite);
  }
  return facts.interrupted ? 130 : 0;
}

/// \throws std::runtime_error if something that was printed did not arrive, on a full disk for instance
void requirePrinted() {
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
    throw std::runtime_error("cannot write to the standard output");
  }
}

}  // namespace

int main(int argc, char** argv) {
  waitPassively(argv);
  CLI::App app{
      "Simulates a scene of bodies that attract each other, collide, rub, spin and settle.\n"
      "Without a scene file: a cloud of 2000 rocks that becomes a rubble pile.",
      "gravel-run"};
  Options options;
  const auto addName = [&](const char* option, std::string& name, const char* of, const char* help) {
    app.add_option(option, name, help)->check([of](const std::string& text) {
      return text.empty() ? std::string("is empty; allowed: the name of a ") + of : std::string();
    });
  };
  addName("scene", options.sceneFile, "file", "scene file (TOML), see examples/scenes");
  addName("-o,--output", options.output, "folder",
          "folder for what is written; default: out/<name of the scene>");
  addName("--save", options.save, "file", "file for the state at the end, or where the run was stopped");
  addName("--restart", options.restart, "file",
          "saved state of this scene that the run goes on from, to the end of its duration");
  app.add_option("--duration", options.duration, "time to simulate, in place of the scene's own")
      ->check([](const std::string& text) {
        double time = 0.0;
        const detail::Range<double> positive = detail::positive<double>();
        return CLI::detail::lexical_cast(text, time) && positive.contains(time)
                   ? std::string()
                   : "is " + text + "; allowed: a number, " + positive.allowed(time);
      });
  app.add_option("--frames", options.frames,
                 "number of frames for ParaView, in place of the scene's own; 0: none")
      ->check([](const std::string& text) {
        std::int64_t frames = 0;
        return CLI::detail::lexical_cast(text, frames) && frames >= 0 &&
                       static_cast<std::uint64_t>(frames) <= mostRecords
                   ? std::string()
                   : "is " + text + "; allowed: a whole number, 0 to " + std::to_string(mostRecords);
      });
  app.add_option("--threads", options.threads, "threads; default: all (or OMP_NUM_THREADS)")
      ->check(CLI::Range(1, 4096));
  app.add_flag("--no-picture", options.noPicture, "draw no picture");
  app.add_flag("-q,--quiet", options.quiet, "print errors only");
  app.add_flag("--profile", options.profile, "print at the end what each phase of a step cost");
  app.add_flag("--check", options.check, "only read the scene and say what is wrong with it");
  app.set_version_flag("--version", format("gravel %d.%d.%d", version.major, version.minor, version.patch));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (app.exit(error) != 0) {
      return 2;
    }
    return std::cout.flush() ? 0 : 1;  // of --help and --version
  }
#ifdef _OPENMP
  if (options.threads > 0) {
    omp_set_num_threads(options.threads);
  }
#endif
  try {
    const int status = run(options);
    requirePrinted();
    return status;
  } catch (const SceneError& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    const std::string_view words = error.what(), name = "gravel: ";  // which the library's own begin with
    std::fprintf(stderr, "gravel-run: %s\n", error.what() + (words.starts_with(name) ? name.size() : 0));
    return 1;
  }
}
