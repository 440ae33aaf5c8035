#include "analyzers/model/eni_slaves.h"

namespace ecaudit::model {

const SlaveModel& EniSlaves::Of(std::size_t number) {
  if (unmet_.size() <= number) unmet_.resize(number + 1);
  Unmet& unmet = unmet_[number];
  if (unmet.model == nullptr) {
    unmet.state = std::make_unique<track::SlaveState>();
    unmet.model = std::make_unique<SlaveModel>(kNoSlave, *unmet.state, limits_, no_events_);
    const device::EniSlave& eni = eni_->slaves[number];
    bus::SlaveAddress address;
    if (const auto position = eni.position()) address.position = Known<SlavePos>::Inferred(*position, 0);
    if (eni.station_address) address.station = Known<StationAddress>::Inferred(*eni.station_address, 0);
    choice_.Choose(address, {}, *unmet.model);
    unmet.model->eni = &eni;
    unmet.model->process.SetFamily(*unmet.model->profile);
    unmet.model->process.SetEni(&eni, eni_);
  }
  return *unmet.model;
}

}  // namespace ecaudit::model
