# gnuplot -e "table='soft_vessel_push.csv'; plot_file='soft_vessel_push.svg'" plot.gp
set terminal svg size 640,440 font 'Helvetica,13' background rgb 'white'
set output plot_file
set datafile separator ','
set xlabel 'insertion [mm]'
set ylabel 'push force [N]'
set xrange [130:260]
set yrange [0:*]
set grid
set key top left
plot for [w in '0.3e6 0.6e6 3e6 30e6 300e6'] table using (strcol(1) eq w ? $2 * 1e3 : 1/0):3 with lines lw 1.5 \
    title 'E = '.w.' Pa', \
    table using (strcol(1) eq 'rigid' ? $2 * 1e3 : 1/0):3 with lines lw 2 dt 2 lc rgb 'black' title 'rigid wall'
