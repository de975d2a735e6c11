# Sources compiled in one go, a list each: their helpers have names of their own, and most of what they read is the
# same. A source that is in no list is compiled alone; one whose helpers' names are taken ("redefinition of ...")
# moves to another list.
vantage_together(vantage_codecs drivers
  "agilex_codec agilex_encode agilex_faults agilex_offline agilex_uart rtnetlink_codec vn100_startup"
  "cia402 cia402_layout gs_usb_codec safety_map scip_codec sick_lms_codec"
  "cola_codec eds_text modbus_errors modbus_frames modbus_offline ubx_codec ubx_encode ubx_epochs"
  "eds link_address offline_stream ptu_codec site_frame victron_map"
  "canopen_codec canopen_faults canopen_offline canopen_pdo canopen_sdo sweep_assembly"
  "gnss_demux gnss_offline ouster_codec ouster_metadata ouster_offline ublox_startup"
  "gpsd_codec pan_fit sick_lms_encode sick_lms_offline sick_lms_startup"
  "nmea_codec nmea_epochs nmea_gga recognise velodyne_codec waveshare_map"
  "clock_fit resync vn100_codec vn100_encode vn100_frames")
vantage_together(vantage_drivers drivers
  "flir_ptu link_trouble ouster peers tcp_stream"
  "hokuyo real_clock socketcan usb_events velodyne"
  "frame_reader gs_usb gs_usb_adapter sick_lms"
  "agilex_drive gnss_output gpsd_client port_search serial_port"
  "profile_loop profile_stream udp_port udp_scanner"
  "power_io signal stream_health ublox"
  "cia402_drive cia402_troubles sweep_scanner vn100"
  "cia402_bring_up modbus_client modbus_line nmea_gnss")
vantage_together(vantage_sim sim
  "can_wire cast_ahead cia402_unit facets flir_ptu_unit gnss_source ground gs_usb_unit hokuyo_unit modbus_server noise
   ouster_unit pan_motion people position_tree reachable register_wire scan scene sim_clock surface_samples
   surface_truth uart ublox_unit unit_faults usbip_server velodyne_unit witnessed_scanner world"
  "agilex_unit mesh placement power_units profile_caster sick_lms_unit stream_wire"
  "datagram_wire ray_bundle vn100_unit"
  "gpsd_unit"
  "nmea_unit")
vantage_together(vantage_backends mission
  "main_gate main_hardware main_links main_robot main_scanner main_sim main_units main_worker"
  "main_corrections main_run main_watch main_realtime main_service main_serving main_console main_console_places")
vantage_together(make_sites tools
  "make_sites make_sites_courtyard make_sites_model make_sites_shapes make_sites_site")
