/// in: what is known of a slave's address and identity, and the user's options and files.  out: the description that it
/// is evaluated by, and how that was chosen.
///
/// The family comes from --profile, else from the identity, else it is "generic". An ESI device of that identity lies
/// over it: PDOs, objects, sync managers and mailbox are those of the file, while what only manuals state (AL tables,
/// codes, limits) stays the family's. What is in the slots of a modular device comes from F030h or F050h. An ENI names
/// slaves and fills in the identity where the capture does not show it; it never beats the capture.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "analyzers/options/device_files.h"
#include "analyzers/options/options.h"
#include "decoder/bus/slave_set.h"
#include "decoder/device/device_description.h"
#include "decoder/process/pdo_mapping.h"
#include "decoder/track/events.h"

namespace ecaudit::model {

struct SlaveModel;

class ProfileChoice {
 public:
  /// @param options must outlive this
  explicit ProfileChoice(const AnalysisOptions& options) : options_(options) {}

  /// Sets profile, profile_source, identity, eni and name of `slave`. The pointers stay valid as long as this and the
  /// options.
  /// @param seen  identity as the capture shows it, whatever of it
  /// @param slave  its `modules` are looked at, too
  void Choose(const bus::SlaveAddress& address, const track::IdentityLearned& seen, SlaveModel& slave);
  /// The user's ENI file; null: none.
  [[nodiscard]] const device::EniConfig* eni() const {
    return options_.files && options_.files->eni ? &options_.files->eni->content : nullptr;
  }

 private:
  [[nodiscard]] const device::ProfileRegistry& families() const;
  struct EsiMatch {
    const device::DeviceDescription* device = nullptr;
    const std::string* file = nullptr;
    bool assumed = false;  ///< the identity is unknown, and the files describe one product only
  };

  [[nodiscard]] const device::EniSlave* FindEni(const bus::SlaveAddress& address) const;
  [[nodiscard]] EsiMatch FindEsi(const track::IdentityLearned& identity) const;
  /// The family and how it was found.
  /// @param seen  PDOs that the slave has assigned: of several editions one that describes them is taken
  [[nodiscard]] std::pair<const device::DeviceDescription*, std::string> FindFamily(
      const bus::SlaveAddress& address, const track::IdentityLearned& identity, bool with_esi,
      const process::PdoMapping& seen) const;
  [[nodiscard]] const device::DeviceDescription* Overlay(const device::DeviceDescription& family,
                                                         const device::DeviceDescription& esi);
  /// `device` with the modules that the slave's lists name.
  /// @param file  the ESI, for texts  @param source  how the description was chosen; gets notes about the file
  [[nodiscard]] const device::DeviceDescription* WithModules(const device::DeviceDescription& device,
                                                             const SlaveModel& slave, const std::string& file,
                                                             std::string& source);

  /// Stations of a bus have few different sets of modules; what a capture changes again and again is not described.
  static constexpr std::size_t kMaxModular = 64;

  const AnalysisOptions& options_;
  /// Families with an ESI device over them, by both.
  std::map<std::pair<const device::DeviceDescription*, const device::DeviceDescription*>,
           std::unique_ptr<const device::DeviceDescription>>
      overlays_;
  /// Those with modules in their slots.
  std::map<std::pair<const device::DeviceDescription*, std::vector<std::uint32_t>>,
           std::unique_ptr<const device::DeviceDescription>>
      modular_;
};

}  // namespace ecaudit::model
